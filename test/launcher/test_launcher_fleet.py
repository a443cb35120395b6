# SPDX-License-Identifier: Apache-2.0
"""A fleet as real processes: the core's decisions in any start sequence; clean shutdown."""

import json
import os
import random
import signal
from dataclasses import replace
from pathlib import Path

import pytest
from launched_programs import Program, complete
from waiting import wait_until

from mfba_planner.core.errors import ConfigError
from mfba_planner.launcher import node_processes
from mfba_planner.launcher.run_arguments import MOST_ROBOTS, read_request
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.configuration_attachment import read_configuration
from mfba_planner.recording.read_episode import read_recording
from mfba_planner.scenarios.run_config import OF_ROBOT, Parameters, with_perception
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.fleet import run_fleet
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.run_episode import simulate_fleet
from mfba_planner.simulation.scenario import FleetRobot, Scenario

PROCESSES = ["--driver", "multi-process", "--no-picture", "--out", "run"]
PAPER = ["--planner", "paper"]
LONG = [*PAPER, *PROCESSES, "--set", "planner.step_length_m=0.002"]
PAIR = Scenario(
    name="pair",
    start_m=(0.0, 0.0),
    goal_m=(4.0, 0.0),
    obstacles=(Obstacle(center_m=(2.0, 3.0), radius_m=0.3, speed_mps=0.1),),
    robots=(
        FleetRobot(name="east", start_m=(0.0, 0.0), goal_m=(4.0, 0.0)),
        FleetRobot(name="west", start_m=(3.5, 0.1), goal_m=(0.0, 0.0)),
    ),
)


@pytest.fixture
def pair_directory(tmp_path: Path) -> Path:
    """A directory with the pair's scenario."""
    (tmp_path / "pair.json").write_text(scenario_to_json(PAIR), encoding="utf-8")
    return tmp_path


def test_two_robots_as_six_processes_decide_as_in_one(pair_directory: Path) -> None:
    planner_args = "--planner-args=-p view_period_s:=7.5"
    done = complete(
        "launcher",
        "pair.json",
        "--seed",
        "3",
        *PAPER,
        *PROCESSES,
        planner_args,
        cwd=pair_directory,
    )
    assert (done.process.returncode, done.stderr) == (0, "")
    recorded = read_recording(pair_directory / "run/bag").episodes
    core = run_fleet(PAIR, seed=3)
    assert list(recorded) == ["east", "west"]
    assert [digest(e.ticks) for e in recorded.values()] == [digest(e.ticks) for e in core]
    assert tuple(replace(e, driver="core") for e in recorded.values()) == core
    assert len(core[0].ticks) != len(
        core[1].ticks
    )  # one arrives first; its planner is not called again
    assert "[west/planner] INFO: goal_pose: on to (0.0, 0.0)" in done.stdout
    assert "2 of 2 robots at the goal without collision" in done.stdout
    found = sorted(path.name for path in (pair_directory / "run").iterdir())
    assert found == ["bag", "east.json", "log.txt", "west.json"]
    assert json.loads((pair_directory / "run/west.json").read_text())["driver"] == "multi-process"
    with BagReader(pair_directory / "run/bag") as reader:
        counts = {name: topic.message_count for name, topic in reader.topics.items()}
        nodes = read_configuration(reader)["nodes"]
    of_robots = {f"{robot}/{node}" for robot in recorded for node in OF_ROBOT}
    assert set(nodes) == {"world_sim", *of_robots}
    assert [nodes[f"{robot}/planner"]["view_period_s"] for robot in recorded] == [7.5, 7.5]
    for episode, name in zip(core, recorded):
        for topic in ("odom", "obstacles", "sectors", "goal_step", "cmd_vel", "plan"):
            assert counts[f"/{name}/{topic}"] == len(episode.ticks)
    assert counts["/clock"] == max(len(episode.ticks) for episode in core)


def test_nodes_may_start_in_any_sequence(
    pair_directory: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also other sequences than the launcher's own; the recorder may be the last."""
    start = node_processes.NodeProcesses.start
    sequences: list[list[str]] = []

    def shuffled(
        self: node_processes.NodeProcesses, parameters: Parameters, extra: dict[str, list[str]]
    ) -> None:
        names = list(parameters)
        random.Random(len(sequences)).shuffle(names)
        sequences.append(names)
        start(self, {name: parameters[name] for name in names}, extra)

    monkeypatch.setattr(node_processes.NodeProcesses, "start", shuffled)
    monkeypatch.chdir(pair_directory)
    from mfba_planner import launcher

    planner = read_request([], "launcher").config.planner  # the default planner
    scenario, planner = with_perception(PAIR, planner)
    core = simulate_fleet(scenario, planner=planner, sensor=SensorParams(), seed=1)
    for name in ("one", "two"):
        args = ["pair.json", "--seed", "1", *PROCESSES[:-1], name]
        assert launcher.main(args) == 0, capsys.readouterr().out
        recorded = read_recording(pair_directory / name / "bag").episodes
        assert [e.ticks for e in recorded.values()] == [e.ticks for e in core]
    assert sequences[0] != sequences[1]


@pytest.mark.parametrize("node", ["west/planner", "east/virtual_sensor"])
def test_a_killed_node_is_named_with_its_robot(pair_directory: Path, node: str) -> None:
    with Program("launcher", "pair.json", *LONG, cwd=pair_directory) as program:
        program.wait_for_data(pair_directory / "run")
        os.kill(program.node(node), signal.SIGKILL)
        assert program.end() == 1
        assert program.processes() == []
    assert program.stderr.count("\n") == 1
    assert program.stderr.startswith(f"launcher: {node} ended (killed by SIGKILL)")
    assert program.stderr.endswith("; what was recorded is in run\n")
    for name, episode in read_recording(pair_directory / "run/bag").episodes.items():
        assert episode.outcome is Outcome.INTERRUPTED
        assert len(episode.ticks) > 10
        result = json.loads((pair_directory / f"run/{name}.json").read_text())
        assert result["extra"]["failure"].startswith(f"{node} ended")


def test_ctrl_c_leaves_a_complete_bag_and_no_process(pair_directory: Path) -> None:
    with Program("launcher", "pair.json", *LONG, cwd=pair_directory) as program:
        program.wait_for_data(pair_directory / "run")
        program.send_group(signal.SIGINT)
        assert program.end() == 130
        assert program.processes() == []
    assert program.stderr == "interrupted by SIGINT; what was recorded is in run\n"
    east, west = read_recording(pair_directory / "run/bag").episodes.values()
    assert len(east.ticks) == len(west.ticks) > 10


def test_nodes_do_not_outlive_a_killed_launcher(pair_directory: Path) -> None:
    with Program("launcher", "pair.json", *LONG, cwd=pair_directory) as program:
        program.wait_for_data(pair_directory / "run")
        program.process.kill()
        wait_until(lambda: program.processes() == [], timeout_s=30.0)


def test_too_many_robots_for_discovery_are_refused(tmp_path: Path) -> None:
    robots = tuple(
        FleetRobot(name=f"r{n}", start_m=(0.0, float(n)), goal_m=(9.0, float(n)))
        for n in range(MOST_ROBOTS + 1)
    )
    file = tmp_path / "many.json"
    first = robots[0]
    many = Scenario(name="many", start_m=first.start_m, goal_m=first.goal_m, robots=robots)
    file.write_text(scenario_to_json(many), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"15 robots would be 32 processes of .*; give --dr"):
        read_request([str(file), "--driver", "multi-process"], "launcher")
    file.write_text(scenario_to_json(replace(many, robots=robots[:-1])), encoding="utf-8")
    read_request([str(file), "--driver", "multi-process"], "launcher")
