# SPDX-License-Identifier: Apache-2.0
"""Failures of the launcher: one line, the right exit code, no process left running."""

import json
import os
import re
import signal
import threading
from pathlib import Path

import pytest
from launched_programs import LONG, Program, complete
from waiting import wait_until

from mfba_planner import launcher
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.recording.recover import recover
from mfba_planner.simulation.episode import Outcome


def only_line(program: Program) -> str:
    assert program.stderr.count("\n") == 1, program.stderr
    return program.stderr


@pytest.mark.parametrize(
    ("args", "line"),
    [
        (["case3"], "launcher: 'case3': no such scenario; did you mean 'case2'?"),
        (["no.yaml"], "launcher: no.yaml: No such file or directory; give a readable"),
        (["--sed", "1"], "launcher: --sed: unknown argument; did you mean '--seed'?"),
        (["--seed", "one"], "launcher: --seed: invalid int value: 'one'; see `launcher --help`"),
        (["--seed", "-1"], "launcher: seed=-1: out of range; give a value in [0,"),
        (["case1", "case2"], "launcher: case2: unknown argument; see `launcher --help`"),
        (["--set", "planner.sped=1"], "launcher: --set planner.sped: unknown option; did you"),
        (["--set", "planner.speed_mps"], "launcher: --set planner.speed_mps: no value; give"),
        (["--set", "planner.speed_mps=fast"], "launcher: speed_mps='fast': give a number"),
        (["--set", "planner.bat.population=1"], "launcher: population=1: out of range; give"),
        (["--set", "sensor.sensing_range_m=nan"], "launcher: sensing_range_m=nan: not finite;"),
        (["--reading", "fig2"], "launcher: 'fig2': unknown planner reading; did you mean"),
        (["--swarm", "x"], "launcher: 'x': unknown swarm reading; known: best, literal, robust"),
        (["--speed", "0"], "launcher: speed_factor=0.0: out of range; give"),
        (
            ["--timeout", "0"],
            "launcher: --timeout=0: out of range; give a finite number above 0, s",
        ),
        (["--driver", "core", "--real-time"], "launcher: --real-time: the core driver has no"),
        (["--driver", "core", "--planner-args=-p"], "launcher: --planner-args: the core driver"),
        (["--planner-args", '"-p'], 'launcher: --planner-args "-p: No closing quotation; quote'),
        (["--out", "taken"], "launcher: taken: exists already and is never overwritten; choose"),
        (["--out", "file/run"], "launcher: file/run: cannot be created (Not a directory); choose"),
    ],
)
def test_a_bad_request_is_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    args: list[str],
    line: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").mkdir()
    Path("file").touch()
    assert run_and_return_exit_code(lambda: launcher.main(args), "launcher") == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(line)
    assert captured.err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "taken"]


def test_missing_middleware_is_one_line(tmp_path: Path) -> None:
    done = complete("launcher", cwd=tmp_path, RMW_IMPLEMENTATION="rmw_nothing")
    assert (done.process.returncode, done.stdout) == (1, "")
    assert only_line(done).startswith("launcher: RMW_IMPLEMENTATION=rmw_nothing: ")
    assert [*tmp_path.iterdir()] == []


def test_node_that_refuses_its_arguments_is_named(tmp_path: Path) -> None:
    done = complete("launcher", "--virtual-sensor-args=-p sectors:=2", cwd=tmp_path)
    assert done.process.returncode == 1, done.stderr
    assert only_line(done) == (
        "launcher: virtual_sensor ended (exit code 1); last line: virtual_sensor: "
        "sectors=2: out of range; give a value in [3, 3600]\n"
    )
    assert [*tmp_path.iterdir()] == []


def test_where_a_node_sent_nothing_its_log_is_named(tmp_path: Path) -> None:
    """A machine with less load would not help: the sensor refuses each message."""
    world = "--world-sim-args=-p scenario:=case2"
    done = complete("launcher", "case1", "--planner", "paper", world, "--out", "run", cwd=tmp_path)
    assert done.process.returncode == 1
    line = only_line(done)
    assert re.match(r"launcher: run/bag: incomplete, 0 of \d+ messages on /sensory_vector;", line)
    assert line.endswith("; see run/log.txt; what was recorded is in run\n")
    assert "5 obstacles but 3 obstacle_radii_m" in (tmp_path / "run/log.txt").read_text()


def test_second_launcher_in_the_same_directory_is_refused(tmp_path: Path) -> None:
    with Program("launcher", *LONG, "--out", "run", cwd=tmp_path) as first:
        wait_until(lambda: (tmp_path / "run").exists(), timeout_s=30.0)
        second = complete("launcher", *LONG, "--out", "run", cwd=tmp_path)
        assert second.process.returncode == 1
        assert only_line(second).startswith("launcher: run: exists already")
        assert first.process.poll() is None
        first.process.send_signal(signal.SIGINT)
        first.end()


@pytest.mark.parametrize("node", ["planner", "world_sim"])
def test_node_killed_during_the_run_is_named(tmp_path: Path, node: str) -> None:
    with Program("launcher", *LONG, "--out", "run", cwd=tmp_path) as program:
        program.wait_for_data(tmp_path / "run")
        os.kill(program.node(node), signal.SIGKILL)
        assert program.end() == 1
        assert program.processes() == []
    assert only_line(program).startswith(f"launcher: {node} ended (killed by SIGKILL)")
    assert program.stderr.endswith("; what was recorded is in run\n")
    recorded = read_episode(tmp_path / "run/bag")
    assert recorded.outcome is Outcome.INTERRUPTED
    assert len(recorded.ticks) > 10
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert result["extra"]["failure"].startswith(f"{node} ended")


def test_recorder_killed_during_the_run_leaves_a_bag_to_recover(tmp_path: Path) -> None:
    with Program("launcher", *LONG, "--out", "run", cwd=tmp_path) as program:
        program.wait_for_data(tmp_path / "run")
        os.kill(program.node("recorder"), signal.SIGKILL)
        assert program.end() == 1
        assert program.processes() == []
    assert only_line(program).startswith("launcher: recorder ended (killed by SIGKILL)")
    assert recover(tmp_path / "run/bag", tmp_path / "whole").messages > 100
    assert len(read_episode(tmp_path / "whole").ticks) > 10


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupted_run_is_complete(tmp_path: Path, number: signal.Signals, code: int) -> None:
    with Program("launcher", *LONG, "--out", "run", cwd=tmp_path) as program:
        program.wait_for_data(tmp_path / "run")
        program.process.send_signal(number)
        assert program.end() == code
        assert program.processes() == []
    assert only_line(program) == f"interrupted by {number.name}; what was recorded is in run\n"
    recorded = read_episode(tmp_path / "run/bag")
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert result["result"]["outcome"] == recorded.outcome.value == "interrupted"
    assert result["result"]["ticks"] == len(recorded.ticks) > 10


@pytest.mark.parametrize("driver", ["in-process", "core"])
def test_interrupted_run_of_one_process_is_complete(tmp_path: Path, driver: str) -> None:
    args = ["walled", "--no-picture", "--set", "planner.step_length_m=0.001", "--out", "run"]
    with Program("launcher", *args, "--driver", driver, cwd=tmp_path) as program:
        if driver == "in-process":
            program.wait_for_data(tmp_path / "run")
        else:
            wait_until(lambda: (tmp_path / "run").exists(), timeout_s=30.0)
        program.process.send_signal(signal.SIGINT)
        assert program.end() == 130
    assert only_line(program) == "interrupted by SIGINT; what was recorded is in run\n"
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert result["result"]["outcome"] == "interrupted"
    assert result["driver"] == driver
    if driver == "in-process":
        assert len(read_episode(tmp_path / "run/bag").ticks) == result["result"]["ticks"]


def test_interrupt_before_the_start_leaves_nothing(tmp_path: Path) -> None:
    with Program("launcher", *LONG, cwd=tmp_path) as program:
        wait_until(lambda: (tmp_path / "runs/run-001").exists(), timeout_s=30.0)
        program.process.send_signal(signal.SIGINT)
        assert program.end() == 130
        assert program.processes() == []
    assert only_line(program) == "interrupted by SIGINT\n"
    assert [*tmp_path.iterdir()] == []


def test_nodes_do_not_outlive_a_killed_launcher(tmp_path: Path) -> None:
    with Program("launcher", *LONG, "--out", "run", cwd=tmp_path) as program:
        program.wait_for_data(tmp_path / "run")
        program.process.kill()
        wait_until(lambda: program.processes() == [], timeout_s=20.0)
    assert len(read_episode(tmp_path / "run/bag").ticks) > 10  # the bag is closed properly


def test_timeout_ends_a_run(tmp_path: Path) -> None:
    done = complete("launcher", *LONG, "--timeout", "4", "--out", "run", cwd=tmp_path)
    assert done.process.returncode == 1
    assert "timeout of 4 s reached; raise --timeout or look at the log" in only_line(done)


def test_closed_stdout_ends_the_run(tmp_path: Path) -> None:
    with Program("launcher", *LONG, "--out", "run", cwd=tmp_path) as program:
        assert program.process.stdout is not None
        program.process.stdout.close()
        program.process.stdout = None
        ended = threading.Thread(target=program.end)
        ended.start()
        ended.join(60.0)
        assert program.process.returncode == 141
        assert program.processes() == []
