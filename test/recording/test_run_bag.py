# SPDX-License-Identifier: Apache-2.0
"""The bag of a real run, decoded by four independent readers: every topic, every tick."""

from pathlib import Path

import pytest
from edited_bags import record
from recorded_bags import count_with_all

from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.configuration_attachment import read_configuration
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.scenarios.scenario_files import load_scenario

# Not published in a simulation of the paper's robot, which has no lidar and no noise.
NOT_PUBLISHED = {"ground_truth", "initialpose", "local_map", "map", "scan", "waypoints"}


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "bag", "case2", 4)


def test_independent_readers_find_every_topic_with_a_message_per_tick(bag: Path) -> None:
    """rosbags, mcap-ros2-support, pybag and small-mcap decode it all and agree."""
    ticks = len(read_episode(bag).ticks)
    assert ticks > 50
    counts = count_with_all(bag)
    for topic in topics.GRAPH:
        name = f"/{topic.name.lstrip('/')}"
        if topic.every_tick:
            assert counts[name] == ticks, name
        else:
            assert (counts[name] >= 1) == (topic.name not in NOT_PUBLISHED), name


def test_the_bag_contains_its_configuration(bag: Path) -> None:
    with BagReader(bag) as reader:
        found = read_configuration(reader)
    assert found["nodes"]["planner"]["seed"] == 4
    assert found["run"]["driver"] == "in-process"
    episode = read_episode(bag)
    assert episode.scenario == load_scenario("case2")
    assert evaluate(episode).success
