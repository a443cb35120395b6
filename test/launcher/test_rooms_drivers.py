# SPDX-License-Identifier: Apache-2.0
"""A place with walls: the three drivers decide alike, with and without the map in the bag."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from launched_programs import complete
from report_readers import data_of, rows_of
from rosbags.highlevel import AnyReader

from mfba_planner import cli
from mfba_planner.launcher import in_process_driver
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.fleet_topics import NO_NAMESPACE
from mfba_planner.recording.local_maps import MapPoints, read_local_maps
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.qos_conversion import offered
from mfba_planner.scenarios.run_config import Driver, RunConfig, graph_parameters
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.verification.verify_bag import verify

WORDS = ("rooms", "--planner", "predictive", "--seed", "1", "--no-picture")
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def config() -> RunConfig:
    return read_request(list(WORDS), "mfba run").config


@pytest.fixture(scope="module")
def expected(config: RunConfig) -> Episode:
    """The core driver's run."""
    return simulate(
        config.scenario, planner=config.planner, sensor=config.sensor, seed=config.seed
    )


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same over DDS, each node a process."""
    directory = tmp_path_factory.mktemp("rooms")
    done = complete("launcher", *WORDS, "--out", "run", cwd=directory)
    assert (done.process.returncode, done.stderr) == (0, "")
    return directory / "run/bag"


@pytest.fixture(scope="module")
def maps(bag: Path) -> tuple[MapPoints, ...]:
    return read_local_maps(bag, [NO_NAMESPACE])[NO_NAMESPACE]


def test_processes_decide_as_the_core_and_verify_agrees(
    bag: Path, expected: Episode, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = read_episode(bag)
    assert expected.outcome is Outcome.GOAL_REACHED
    assert recorded.ticks == expected.ticks
    assert digest(recorded.ticks) == digest(expected.ticks)
    assert any("the way through the map" in tick.reason for tick in expected.ticks), (
        "the map was not used"
    )
    ticks = len(expected.ticks)
    assert cli.main(["verify", str(bag), "--closed-loop"]) == 0
    assert capsys.readouterr().out == (
        f"identical, {ticks} decisions, digest {digest(expected.ticks)}\n"
        f"closed loop: identical, {ticks} ticks\n"
    )


@pytest.mark.parametrize("map_period_s", [0.0, 0.3])
def test_one_process_decides_as_the_core_whatever_the_period_of_the_map(
    map_period_s: float,
    config: RunConfig,
    expected: Episode,
    tmp_path: Path,
    domain_id: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def parameters(config: RunConfig, peers: tuple[str, ...]) -> dict[str, dict[str, Any]]:
        made = {node: dict(values) for node, values in graph_parameters(config, peers).items()}
        made["planner"]["map_period_s"] = map_period_s
        return made

    monkeypatch.setattr(in_process_driver, "graph_parameters", parameters)
    path, config = tmp_path / "bag", replace(config, driver=Driver.IN_PROCESS)
    in_process_driver.run_in_process(config, path, domain_id=domain_id)
    assert read_episode(path).ticks == expected.ticks
    with BagReader(path) as reader:
        assert ("/local_map" in reader.topics) == (map_period_s > 0.0)
        if map_period_s:
            assert reader.topics["/local_map"].message_count > len(expected.ticks) // 5
    report = verify(path)
    assert report.is_identical, report.faults


def test_rosbags_reads_the_maps(bag: Path, expected: Episode) -> None:
    with BagReader(bag) as reader:
        topic = reader.topics["/local_map"]
        logged = {m.message.header.stamp.sec: m for m in reader.decoded(["/local_map"])}
    assert topic.type_name == "nav_msgs/msg/OccupancyGrid"
    assert topic.qos == (offered(topics.LATCHED_QOS),)
    with AnyReader([bag]) as reader:
        connections = [c for c in reader.connections if c.topic == "/local_map"]
        raws = reader.messages(connections)
        found: list[Any] = [reader.deserialize(raw, c.msgtype) for c, _, raw in raws]
    stamps = [m.header.stamp.sec * SECOND + m.header.stamp.nanosec for m in found]
    assert set(stamps) <= {tick.stamp_ns for tick in expected.ticks}
    assert np.diff(stamps).min() >= SECOND
    last_s = expected.ticks[-1].stamp_ns // SECOND
    assert last_s // 2 <= len(found) <= last_s + 1
    for message in found:
        assert message.header.frame_id == "odom"
        assert message.info.width * message.info.height == message.data.size
        assert {0, 100} <= set(message.data.tolist()) <= {-1, 0, 100}
        ours = logged[message.header.stamp.sec]
        assert list(ours.message.data) == message.data.tolist()
    assert sorted(stamps) == [m.log_time_ns for m in logged.values()], "logged at their ticks"
    assert sum(message.data.size for message in found) / len(found) < 40_000, "cut to the room"


def test_the_map_is_the_place(maps: tuple[MapPoints, ...], expected: Episode) -> None:
    """Each occupied cell is near a wall, or near the one obstacle."""
    ends = np.array(expected.scenario.segments_m)
    start, wall = ends[:, :2], ends[:, 2:] - ends[:, :2]
    stamp_ns, points = maps[-1]
    share = ((points[:, None] - start) * wall).sum(axis=2) / (wall * wall).sum(axis=1)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * wall
    away = np.sqrt(((points[:, None] - nearest) ** 2).sum(axis=2)).min(axis=1)
    (center,) = expected.scenario.centers(expected.time_s(stamp_ns))
    from_obstacle = np.sqrt(((points - np.array(center)) ** 2).sum(axis=1))
    assert len(points) > 200
    assert (away[from_obstacle > 1.0]).max() < 0.1


def test_viewers_show_the_maps(bag: Path, maps: tuple[MapPoints, ...], tmp_path: Path) -> None:
    assert cli.main(["view", str(bag), "--save", str(tmp_path / "run.rrd")]) == 0
    assert rows_of(tmp_path / "run.rrd")["/run/world/map"] == len(maps)
    assert cli.main(["report", str(bag), "--out", str(tmp_path / "run.html")]) == 0
    (run,) = data_of(tmp_path / "run.html")["runs"]
    assert len(run["maps"]) == len(maps)
    for shown, (stamp_ns, points) in zip(run["maps"], maps):
        assert round(run["ticks"]["time"][shown["tick"]] * 1e9) == stamp_ns - run_start_ns(bag)
        drawn = np.cumsum(np.array(shown["points"]).reshape(-1, 2), axis=0) / 100.0
        assert len(drawn) == len(points)
        off = np.abs(drawn[:, None] - points).max(axis=2)  # whole cm: half a cm on each axis
        assert off.min(axis=0).max() < 0.0051
        assert off.min(axis=1).max() < 0.0051


def run_start_ns(bag: Path) -> int:
    """The stamp of time 0."""
    episode = read_episode(bag)
    stamp_ns = episode.ticks[0].stamp_ns
    return stamp_ns - round(episode.time_s(stamp_ns) * 1e9)
