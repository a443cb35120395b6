# SPDX-License-Identifier: Apache-2.0
"""examples/mujoco_robot through real processes: decisions, bag, film, and the command line."""

import json
import time
from pathlib import Path

import pytest
from crowded_room import draw_room
from film import HEIGHT_PX, WIDTH_PX
from physics_world import PhysicsWorld
from PIL import Image
from planner_in_process import drive, planner_params, robot_rng
from run import RunOptions, main, run_graph

from mfba_planner.core.errors import ConfigError, OutputError
from mfba_planner.core.geometry import distance
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.scenarios.scenario_files import load_scenario

OF_THE_ROBOT = {"/scan", "/odom", "/tf", "/cmd_vel"}
SHORT_S = 3.0


def test_the_graph_decides_as_the_planner_in_process_and_its_bag_verifies(tmp_path: Path) -> None:
    result = run_graph(RunOptions(world=1, time_limit_s=SHORT_S, film=True), tmp_path / "run")
    recorded = read_episode(tmp_path / "run/bag")
    count = len(recorded.ticks)
    assert count >= SHORT_S / 0.1
    assert (result.verified, result.faults) == (result.decisions, ())
    assert result.decisions == count
    assert recorded.planner.method is planner_params(draw_room(1)).method
    ticks = iter(range(count - 1))
    here = drive(
        PhysicsWorld(draw_room(1), robot_rng(1)),
        seed=1,
        go_on=lambda _: next(ticks, None) is not None,
    )
    assert recorded.ticks == here.episode.ticks
    assert distance(recorded.ticks[0].pose.position, recorded.ticks[-1].pose.position) > 0.5
    assert {tick.perception for tick in recorded.ticks} == {"scan"}

    with BagReader(tmp_path / "run/bag") as reader:
        topics = set(reader.topics)
    assert {"/scan", "/odom", "/cmd_vel"} <= topics
    assert not topics & {"/obstacles", "/clock", "/ground_truth", "/outcome"}
    robot = json.loads((tmp_path / "run/robot.json").read_text(encoding="utf-8"))
    assert SHORT_S <= robot["time_s"] < SHORT_S + 1.0
    assert robot["contacts"] == []
    assert load_scenario(str(tmp_path / "run/world.yaml")) == draw_room(1).scenario
    with Image.open(tmp_path / "run/film.webp") as film:
        assert film.size == (WIDTH_PX + HEIGHT_PX, HEIGHT_PX)
        assert getattr(film, "n_frames", 1) >= SHORT_S / 0.1
        film.seek(20)
        colours = film.convert("RGB").getcolors(2**24)
        assert colours is not None
        assert len(colours) > 1000  # people, walls and floor, shaded


def test_by_the_clock_the_robot_turns_and_stamps_are_those_of_the_clock(tmp_path: Path) -> None:
    # A busy machine is late, but not by so much that the robot is stopped.
    options = RunOptions(
        world=1, people=0, real_time=True, input_timeout_s=10.0, time_limit_s=SHORT_S
    )
    run_graph(options, tmp_path / "run")
    recorded = read_episode(tmp_path / "run/bag")
    assert abs(recorded.ticks[-1].stamp_ns * 1e-9 - time.time()) < 60.0
    # It turns to the goal first, which lies to its left.
    assert max(tick.pose.yaw for tick in recorded.ticks) > 0.1
    with BagReader(tmp_path / "run/bag") as reader:
        counts = {name: topic.message_count for name, topic in reader.topics.items()}
    assert counts["/odom"] > 3 * counts["/scan"]


def test_mistakes_cost_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["run.py", "--world", "-1", "--out", str(tmp_path / "x")])
    with pytest.raises(ConfigError, match=r"--world -1 .*: give numbers from 0 up"):
        main()
    monkeypatch.setattr("sys.argv", ["run.py", "--out", str(tmp_path)])
    (tmp_path / "taken").touch()
    with pytest.raises(OutputError):
        main()
