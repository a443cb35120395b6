# SPDX-License-Identifier: Apache-2.0
"""A scenario's walls as a map known before: the three drivers decide alike, the bag verifies."""

from dataclasses import replace
from pathlib import Path

import pytest
from launched_programs import complete
from ros_graph import Graph

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError, InputError
from mfba_planner.launcher import in_process_driver
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.planning.planner_params import Method, PerceptionInput
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.from_messages import decision, known_map_from, sector_ranges
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.episode_to_bag import write_episode_bag
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.replay import Replay
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.replaying.replay_arguments import parse
from mfba_planner.scenarios.run_config import Driver, RunConfig, graph_parameters
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.verification.verify_bag import verify, verify_each

TRAP = """\
name: trap
start_m: [0.0, 0.0]
goal_m: [5.0, 0.0]
robot_radius_m: 0.2
segments_m:
  - [3.5, -1.5, 3.5, 1.5]
  - [1.0, 1.5, 3.5, 1.5]
  - [1.0, -1.5, 3.5, -1.5]
"""
MAP_FROM_SCENARIO = ("--set", "planner.known_map=true")


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    file = tmp_path_factory.mktemp("trap") / "trap.yaml"
    file.write_text(TRAP, encoding="utf-8")
    return [str(file), "--planner", "predictive", "--no-picture", *MAP_FROM_SCENARIO]


@pytest.fixture(scope="module")
def config(words: list[str]) -> RunConfig:
    return read_request(words, "mfba run").config


def core(config: RunConfig) -> Episode:
    return simulate(
        config.scenario, planner=config.planner, sensor=config.sensor, seed=config.seed
    )


@pytest.fixture(scope="module")
def expected(config: RunConfig) -> Episode:
    return core(config)


@pytest.fixture(scope="module")
def bag(words: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Over DDS, each node a process."""
    directory = tmp_path_factory.mktemp("run")
    done = complete("launcher", *words, "--out", "run", cwd=directory)
    assert (done.process.returncode, done.stderr) == (0, "")
    return directory / "run/bag"


def test_the_map_is_what_decides(config: RunConfig, expected: Episode) -> None:
    assert expected.outcome is Outcome.GOAL_REACHED
    without = core(replace(config, planner=replace(config.planner, known_map=False)))
    assert len(without.ticks) > len(expected.ticks)
    assert digest(without.ticks) != digest(expected.ticks)


def test_processes_decide_as_the_core_and_verify_agrees(
    bag: Path, expected: Episode, capsys: pytest.CaptureFixture[str]
) -> None:
    assert read_episode(bag).ticks == expected.ticks
    assert cli.main(["verify", str(bag), "--closed-loop"]) == 0
    ticks = len(expected.ticks)
    assert capsys.readouterr().out == (
        f"identical, {ticks} decisions, digest {digest(expected.ticks)}\n"
        f"closed loop: identical, {ticks} ticks\n"
    )


def test_one_process_decides_as_the_core(
    config: RunConfig, expected: Episode, tmp_path: Path, domain_id: int
) -> None:
    config, path = replace(config, driver=Driver.IN_PROCESS), tmp_path / "bag"
    in_process_driver.run_in_process(config, path, domain_id=domain_id)
    assert read_episode(path).ticks == expected.ticks
    report = verify(path)
    assert report.is_identical, report.faults


def test_verify_decides_by_the_map_in_the_bag(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not by the scenario's walls, which a robot's bag may not have."""
    with BagReader(bag) as reader:
        (message,) = reader.decoded(["/map"])
    assert message.message.header.frame_id == "odom"
    assert known_map_from(message.message).count > 100
    monkeypatch.setattr("mfba_planner.verification.verify_bag.with_known_map", None)
    assert verify(bag).is_identical
    monkeypatch.setattr("mfba_planner.verification.tick_records.known_map_from", refuse)
    monkeypatch.setattr("mfba_planner.verification.verify_bag.with_known_map", lambda *_: None)
    report = verify(bag)
    assert report.divergence is not None, "without the map other decisions are made"


def refuse(*_: object) -> None:
    raise InputError("no map")


def test_the_bag_of_a_core_run_verifies_by_the_scenario(expected: Episode, tmp_path: Path) -> None:
    write_episode_bag(expected, tmp_path / "bag")
    with BagReader(tmp_path / "bag") as reader:
        assert "/map" not in reader.topics
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


def test_the_bag_of_a_planner_that_takes_no_map_is_written(
    expected: Episode, tmp_path: Path
) -> None:
    """In a sweep the option is given for all planners."""
    planner = replace(expected.planner, perception=PerceptionInput.AUTO, method=Method.PAPER)
    other = replace(expected, planner=planner, planner_name="dwa")
    write_episode_bag(other, tmp_path / "bag")
    assert not read_episode(tmp_path / "bag").planner.known_map


def test_a_replayed_bag_gives_the_map_and_the_same_decisions(
    graph: Graph, bag: Path, config: RunConfig, expected: Episode
) -> None:
    """The map is one message, and no tick is repeated for a planner that waits for it."""
    decisions, sectors = graph.collect(topics.DECISION), graph.collect(topics.SECTORS)
    parameters = graph_parameters(config, ())
    graph.start(VirtualSensor, parameters["virtual_sensor"] | {"wait_for": "planner"})
    graph.start(PlannerNode, parameters["planner"])
    line = "--as-fast-as-possible --inputs-of virtual_sensor planner --exclude obstacles"
    replay = graph.start(Replay, {}, settings=parse([str(bag), *line.split()]))
    while not replay.finished:
        replay.spin_once(graph.executor)
    graph.until(lambda: len(decisions) >= len(expected.ticks))
    found = [decision(why, sector_ranges(ring)) for why, ring in zip(decisions, sectors)]
    assert digest(found) == digest(expected.ticks)


def test_a_fleet_has_the_map_for_each_robot(tmp_path: Path, domain_id: int) -> None:
    file = tmp_path / "two.yaml"
    file.write_text(
        "name: two\nrobot_radius_m: 0.2\nrobots:\n"
        "  - {name: a, start_m: [0.0, 0.0], goal_m: [4.0, 0.0]}\n"
        "  - {name: b, start_m: [0.0, 2.0], goal_m: [4.0, 2.0]}\n"
        "segments_m: [[2.0, -1.0, 2.0, 3.5]]\n",
        encoding="utf-8",
    )
    words = [str(file), "--planner", "predictive", "--no-picture", *MAP_FROM_SCENARIO]
    config, path = read_request(words, "mfba run").config, tmp_path / "bag"
    in_process_driver.run_in_process(config, path, domain_id=domain_id)
    with BagReader(path) as reader:
        assert {"/a/map", "/b/map"} <= set(reader.topics)
    for name, report in verify_each(path).items():
        assert report.is_identical, (name, report.faults)
        assert "through the map" in report.recorded[0].reason, "known before it is seen"


@pytest.mark.parametrize("more", [["--planner", "paper"], ["--set", "planner.perception=sectors"]])
def test_a_planner_that_uses_no_map_is_refused(more: list[str]) -> None:
    with pytest.raises(ConfigError, match="only predictive with a scan uses a map"):
        read_request(["rooms", *more, *MAP_FROM_SCENARIO], "mfba run")


def test_a_place_that_is_too_large_for_a_map_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "large.yaml"
    file.write_text(TRAP + "  - [0.0, 5.0, 900.0, 905.0]\n  - [0, 5, 0, 900]\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="make a map of 18002 x 18132 cells"):
        read_request([str(file), *MAP_FROM_SCENARIO], "mfba run")
