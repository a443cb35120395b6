# SPDX-License-Identifier: Apache-2.0
"""The launcher end to end: real processes and real DDS make the core's decisions."""

import json
import re
from pathlib import Path

import pytest
from launched_programs import Program, complete

from mfba_planner.core.option_specs import override
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.configuration_attachment import read_configuration
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.scenarios import scenario_files
from mfba_planner.simulation import episode, run_episode
from mfba_planner.simulation.run_episode import simulate

PNG = b"\x89PNG\r\n\x1a\n"

PAPER = ("--planner", "paper", "--no-picture")


def check_bag(bag: Path, expected: episode.Episode) -> None:
    """Every topic of the loop once per tick, and the core's decisions."""
    recorded = read_episode(bag)
    assert recorded.ticks == expected.ticks
    assert (recorded.scenario, recorded.planner, recorded.seed) == (
        expected.scenario,
        expected.planner,
        expected.seed,
    )
    with BagReader(bag) as reader:
        assert reader.complete
        counts = {name: topic.message_count for name, topic in reader.topics.items()}
        configuration = read_configuration(reader)
    for topic in topics.GRAPH:
        if topic.every_tick:
            assert counts[f"/{topic.name.lstrip('/')}"] == len(expected.ticks), topic.name
    assert set(configuration["nodes"]) == {"world_sim", "virtual_sensor", "planner"}
    assert configuration["run"]["driver"] == recorded.driver


@pytest.mark.parametrize("driver", ["in-process", "multi-process"])
def test_a_run_is_private_whatever_discovery_server_is_set(tmp_path: Path, driver: str) -> None:
    """Through a server, nodes of every domain find each other; without one, none does."""
    words = ("empty", "--driver", driver, *PAPER)
    absent = {"ROS_DISCOVERY_SERVER": "127.0.0.1:11811", "ROS_SUPER_CLIENT": "TRUE"}
    done = complete("launcher", *words, cwd=tmp_path, **absent)
    assert (done.process.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(("scenario", "algorithm"), [("case1", "mfba"), ("case2", "ba")])
def test_multi_process_run_equals_the_core_s(
    tmp_path: Path, scenario: str, algorithm: str
) -> None:
    done = complete("launcher", scenario, "--seed", "3", "--algorithm", algorithm, cwd=tmp_path)
    assert (done.process.returncode, done.stderr) == (0, "")
    run = tmp_path / "runs" / "run-001"
    assert sorted(path.name for path in run.iterdir()) == [
        "bag",
        "log.txt",
        "result.json",
        "run.png",
    ]
    params = override(PlannerParams(), {"bat.algorithm": algorithm})
    expected = run_episode.run(scenario_files.load_scenario(scenario), planner=params, seed=3)
    check_bag(run / "bag", expected)
    assert (run / "run.png").read_bytes().startswith(PNG)
    result = json.loads((run / "result.json").read_text())
    assert result["result"]["success"] is True
    assert result["result"]["ticks"] == len(expected.ticks)
    assert result["driver"] == "multi-process"
    (ready_s,) = re.findall(r"^4 nodes are ready after (\d+\.\d) s$", done.stdout, re.MULTILINE)
    assert 0.0 < float(ready_s) < 60.0
    assert result["extra"]["ticks_per_s"] > 0
    assert f"{scenario}, {algorithm}, seed 3, multi-process driver" in done.stdout
    assert "[world_sim] INFO: run over: goal_reached" in done.stdout
    assert "[world_sim] INFO: run over: goal_reached" in (run / "log.txt").read_text()
    assert "wrote runs/run-001: bag, log.txt, result.json, run.png" in done.stdout


def test_in_process_run_equals_the_core_s(tmp_path: Path) -> None:
    done = complete(
        "launcher", "--driver", "in-process", "--out", "a/b", "--no-picture", cwd=tmp_path
    )
    assert (done.process.returncode, done.stderr) == (0, "")
    config = read_request([], "launcher").config
    assert config.planner.method is Method.PREDICTIVE
    expected = simulate(config.scenario, planner=config.planner, sensor=config.sensor, seed=0)
    check_bag(tmp_path / "a/b/bag", expected)
    assert sorted(path.name for path in (tmp_path / "a/b").iterdir()) == ["bag", "result.json"]


def test_core_run_writes_result_and_picture(tmp_path: Path) -> None:
    done = complete("launcher", "case2", "--driver", "core", cwd=tmp_path)
    assert (done.process.returncode, done.stderr) == (0, "")
    assert "wrote runs/run-001: result.json, run.png" in done.stdout
    result = json.loads((tmp_path / "runs/run-001/result.json").read_text())
    assert (result["driver"], result["result"]["success"]) == ("core", True)


def test_two_launchers_at_once_use_different_domains(tmp_path: Path) -> None:
    with (
        Program("launcher", "case1", "--seed", "1", *PAPER, cwd=tmp_path) as first,
        Program("launcher", "case2", "--seed", "2", *PAPER, cwd=tmp_path) as second,
    ):
        assert [first.end(), second.end()] == [0, 0], first.stderr + second.stderr
    episodes = [read_episode(run / "bag") for run in sorted((tmp_path / "runs").iterdir())]
    found = {recorded.scenario.name: recorded.ticks for recorded in episodes}
    assert found == {
        name: run_episode.run(scenario_files.load_scenario(name), seed=seed).ticks
        for name, seed in (("case1", 1), ("case2", 2))
    }


def test_real_time_run_reaches_the_goal(tmp_path: Path) -> None:
    done = complete("launcher", "empty", "--speed", "4", *PAPER, "--out", "run", cwd=tmp_path)
    assert (done.process.returncode, done.stderr) == (0, "")
    assert "m to the goal, path generation" in done.stdout  # progress, without a terminal
    recorded = read_episode(tmp_path / "run/bag")
    assert recorded.outcome is episode.Outcome.GOAL_REACHED


def test_node_arguments_reach_their_node(tmp_path: Path) -> None:
    done = complete(
        "launcher",
        "empty",
        "--no-picture",
        "--planner-args=-p view_period_s:=7.5 --log-level debug",
        "--out",
        "run",
        cwd=tmp_path,
    )
    assert done.process.returncode == 0, done.stderr
    assert "[planner] DEBUG: " in done.stdout
    with BagReader(tmp_path / "run/bag") as reader:
        assert read_configuration(reader)["nodes"]["planner"]["view_period_s"] == 7.5


def test_time_limit_is_no_success(tmp_path: Path) -> None:
    world = tmp_path / "far.yaml"
    world.write_text("name: far\nstart_m: [0.0, 0.0]\ngoal_m: [90.0, 0.0]\ntime_limit_s: 3.0\n")
    done = complete("launcher", "far.yaml", "--no-picture", "--out", "run", cwd=tmp_path)
    assert done.process.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "launcher: run: no success: 87.60 m left to the goal after 3.06 s" in done.stderr
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert result["result"]["outcome"] == "time_limit"
