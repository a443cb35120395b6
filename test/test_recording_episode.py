# SPDX-License-Identifier: Apache-2.0
"""Bags back to Episodes: what lacks or is garbled is named; a run that was cut short is read."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers import claim_domain
from rclpy.serialization import deserialize_message, serialize_message
from recording_bags import FOREIGN

from mfba_planner.core.episode import Outcome, run
from mfba_planner.core.errors import BagError
from mfba_planner.recording.configuration import attach_configuration, read_configuration
from mfba_planner.recording.episode import read_episode
from mfba_planner.recording.reader import BagReader
from mfba_planner.recording.writer import BagWriter
from mfba_planner.ros import topics
from mfba_planner.ros.in_process import run_in_process
from mfba_planner.run_config import Driver, RunConfig
from mfba_planner.scenarios import load_scenario

Change = Callable[[str, Any], Any]  # (topic, message) -> message, or None to leave it out


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("episode") / "bag"
    config = RunConfig(scenario=load_scenario("empty"), driver=Driver.IN_PROCESS, seed=2)
    domain, lock = claim_domain()
    with lock:
        run_in_process(config, directory, domain_id=domain)
    return directory


def edited(bag: Path, out: Path, change: Change, configure: Change = lambda _, c: c) -> Path:
    """A copy with messages and configuration changed."""
    kinds = {f"/{t.name.lstrip('/')}": t.type for t in topics.GRAPH}
    with BagReader(bag) as reader, BagWriter(out) as writer:
        content = configure("configuration", read_configuration(reader))
        if content is not None:
            attach_configuration(writer, content)
        for raw in reader.messages():
            message = change(raw.topic, deserialize_message(raw.data, kinds[raw.topic]))
            if message is not None:
                writer.add_topic(raw.topic, raw.type_name)
                data = bytes(serialize_message(message))
                writer.write(raw.topic, data, raw.log_time_ns, raw.publish_time_ns)
    return out


def keep(_: str, message: Any) -> Any:
    return message


def without(topic: str) -> Change:
    return lambda name, message: None if name == topic else message


def with_value(key: str, value: str) -> Change:
    def change(name: str, message: Any) -> Any:
        if name == "/planner/decision":
            for item in message.status[0].values:
                if item.key == key:
                    item.value = value
        return message

    return change


def test_copy_is_the_same_episode(bag: Path, tmp_path: Path) -> None:
    episode = read_episode(edited(bag, tmp_path / "copy", keep))
    assert episode == read_episode(bag)
    assert episode.ticks == run(load_scenario("empty"), seed=2).ticks
    assert (episode.driver, episode.seed) == ("in-process", 2)


def test_foreign_bag_has_no_configuration() -> None:
    with pytest.raises(BagError, match=r"no mfba_planner/configuration\.json"):
        read_episode(FOREIGN)


@pytest.mark.parametrize("topic", ["/sectors", "/planner/decision"])
def test_a_topic_that_is_missing_is_named(bag: Path, tmp_path: Path, topic: str) -> None:
    with pytest.raises(BagError, match=f"holds no {topic}; give"):
        read_episode(edited(bag, tmp_path / "cut", without(topic)))


def test_a_decision_without_its_sectors_is_named(bag: Path, tmp_path: Path) -> None:
    def cut(name: str, message: Any) -> Any:
        return None if name == "/sectors" and message.header.stamp.sec == 3 else message

    with pytest.raises(BagError, match=r"no sectors at stamp 3\d{9} ns; was the bag edited"):
        read_episode(edited(bag, tmp_path / "cut", cut))


@pytest.mark.parametrize(
    ("key", "value"),
    [("mode", "flying"), ("gap", "x"), ("waypoint", "1,2,3"), ("pose", "1,2"), ("vs", "0a0")],
)
def test_a_garbled_decision_is_refused(bag: Path, tmp_path: Path, key: str, value: str) -> None:
    with pytest.raises(BagError, match=r"garble|not a list of points"):
        read_episode(edited(bag, tmp_path / "garbled", with_value(key, value)))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda c: c["nodes"].pop("planner"), "lacks 'planner'"),
        (lambda c: c["nodes"]["planner"].pop("bat.rho"), "lacks 'bat.rho'"),
        (lambda c: c.pop("run"), "lacks 'run'"),
        (lambda c: c["nodes"]["planner"].update({"bat.population": 1}), "population=1"),
        (lambda c: c["nodes"]["world_sim"].update(scenario_json="{}"), "missing"),
    ],
)
def test_a_configuration_that_explains_nothing_is_refused(
    bag: Path, tmp_path: Path, change: Callable[[Any], Any], reason: str
) -> None:
    def configure(_: str, content: Any) -> Any:
        content = json.loads(json.dumps(content))
        change(content)
        return content

    with pytest.raises(BagError) as caught:
        read_episode(edited(bag, tmp_path / "odd", keep, configure))
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_refused_sectors_are_an_episode_all_the_same(bag: Path, tmp_path: Path) -> None:
    """What the planner refused, the reader does not take for free space either."""

    def blind(name: str, message: Any) -> Any:
        if name == "/sectors":
            message.ranges = [float("nan")] * 12
        return message

    episode = read_episode(edited(bag, tmp_path / "blind", blind))
    assert {tick.ranges_m for tick in episode.ticks} == {()}


def test_a_run_cut_short_is_interrupted_and_reads_with_salvage(bag: Path, tmp_path: Path) -> None:
    copy = edited(
        bag,
        tmp_path / "short",
        lambda _, m: m if not hasattr(m, "header") or m.header.stamp.sec < 9 else None,
    )
    assert read_episode(copy).outcome is Outcome.INTERRUPTED
    whole = (copy / "short_0.mcap").read_bytes()
    killed = tmp_path / "killed.mcap"
    killed.write_bytes(whole[:-200])
    with pytest.raises(BagError, match="mfba recover"):
        read_episode(killed)
    assert read_episode(killed, salvage=True).ticks == read_episode(copy).ticks
