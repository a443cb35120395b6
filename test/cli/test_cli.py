# SPDX-License-Identifier: Apache-2.0
"""`mfba`: every subcommand, without ROS but for run and replay."""

import json
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest
from launched_programs import PROGRAM, ROOT, complete

from mfba_planner import __version__, cli
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import run

Capture = pytest.CaptureFixture[str]


def mfba(capture: Capture, *args: str) -> tuple[int, str, str]:
    code = run_and_return_exit_code(lambda: cli.main([*args]), "mfba")
    return code, *capture.readouterr()


def refused(capture: Capture, *args: str) -> str:
    """Run a command that fails; return its one line of error."""
    code, out, err = mfba(capture, *args)
    assert (code, out, err.count("\n")) == (1, "", 1)
    return err


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run."""
    directory = tmp_path_factory.mktemp("recorded")
    done = complete(
        "mfba", "run", "case2", "--driver", "in-process", "--no-picture", cwd=directory
    )
    assert (done.process.returncode, done.stderr) == (0, "")
    return directory / "runs/run-001"


def test_help_and_version(capsys: Capture) -> None:
    code, out, _ = mfba(capsys, "--help")
    assert code == 0
    for name in cli.COMMANDS:
        assert f"\n  {name} " in out
    assert mfba(capsys) == (0, out, "")
    assert mfba(capsys, "--version") == (0, f"mfba {__version__}\n", "")


@pytest.mark.parametrize("command", sorted(set(cli.COMMANDS) - {"replay"}))
def test_each_command_has_help(capsys: Capture, command: str) -> None:
    with pytest.raises(SystemExit) as ended:
        mfba(capsys, command, "--help")
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: mfba {command} ")


def test_mistakes_give_one_line(capsys: Capture, tmp_path: Path) -> None:
    assert refused(capsys, "simm") == "mfba: simm: unknown command; did you mean 'sim'?\n"
    assert "--sets=1: unknown argument; did you mean '--set'?" in refused(
        capsys, "sim", "--sets=1"
    )
    assert "the following arguments are required: BAG" in refused(capsys, "info")
    assert "see `mfba scenarios --help`" in refused(capsys, "scenarios", "extra")
    assert "does not exist" in refused(capsys, "info", str(tmp_path / "nothing"))
    assert "does not exist" in refused(capsys, "picture", str(tmp_path / "nothing"), "a.png")
    assert "does not exist" in refused(capsys, "recover", str(tmp_path / "nothing"), "b")
    assert "--seeds=0: out of range" in refused(capsys, "sim", "--seeds", "0")
    assert "holds one run" in refused(capsys, "sim", "--seeds", "2", "--out", "x")


def test_sim_prints_the_core_s_result(capsys: Capture) -> None:
    code, out, err = mfba(capsys, "sim", "case1", "--seed", "5", "--algorithm", "ba")
    assert (code, err) == (0, "")
    assert out.startswith("case1, ba, seed 5, core driver\n  outcome          goal reached\n")


def test_sim_of_many_seeds_prints_each_and_a_summary(capsys: Capture) -> None:
    code, out, err = mfba(capsys, "sim", "case2", "--seed", "7", "--seeds", "3")
    assert (code, err) == (0, "")
    rows = out.splitlines()
    assert [row.split()[0] for row in rows[1:4]] == ["7", "8", "9"]
    assert rows[4].startswith("3 of 3 at the goal without collision; length ")
    single = mfba(capsys, "sim", "case2", "--seed", "8", "--seeds", "1")[1]
    assert rows[2].split()[2] in single


def test_failed_sim_reports_the_reason(capsys: Capture, tmp_path: Path) -> None:
    world = tmp_path / "shut.yaml"
    world.write_text("name: shut\nstart_m: [0.0, 0.0]\ngoal_m: [50.0, 0.0]\ntime_limit_s: 2.0\n")
    code, out, err = mfba(capsys, "sim", str(world))
    assert code == 1
    assert "outcome          time limit" in out
    assert err.startswith("mfba: no success: 48.")
    code, out, err = mfba(capsys, "sim", str(world), "--seeds", "2")
    assert (code, "0 of 2 at the goal without collision\n" in out) == (1, True)
    assert err.startswith("mfba: 2 of 2 seeds failed; look at one of them")


def test_sim_can_write_its_run(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "kept"
    assert mfba(capsys, "sim", "--out", str(out))[0] == 0
    assert sorted(path.name for path in out.iterdir()) == ["result.json", "run.png"]
    assert json.loads((out / "result.json").read_text())["driver"] == "core"
    assert "exists already" in refused(capsys, "sim", "--out", str(out))


def test_scenarios_and_options_are_listed(capsys: Capture) -> None:
    code, out, _ = mfba(capsys, "scenarios")
    assert code == 0
    assert re.search(r"^case1 +Case study 1, three dynamic obstacles \(Table 4\)$", out, re.M)
    code, out, _ = mfba(capsys, "options")
    assert code == 0
    assert "planner.bat.algorithm " in out
    assert "sensor.sensing_range_m " in out
    usual = "planner.bat.iterations=1, planner.method=predictive, planner.step_length_m=0.08\n"
    assert out.endswith(f"Defaults without --planner: {usual}")


def test_info_prints_topics_and_result(capsys: Capture, recorded: Path) -> None:
    code, out, err = mfba(capsys, "info", str(recorded / "bag"))
    assert (code, err) == (0, "")
    assert "Topic:       /planner/decision" in out
    assert "case2, predictive, seed 0, in-process driver\n" in out
    assert mfba(capsys, "info", str(recorded))[1] == out  # the run's directory is accepted too


def test_info_of_a_foreign_bag(capsys: Capture) -> None:
    code, out, err = mfba(capsys, "info", str(ROOT / "test/data/rosbag2_foreign_scan"))
    assert (code, err) == (0, "")
    assert "outcome" not in out


def test_recover_and_picture(capsys: Capture, recorded: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes((recorded / "bag/bag_0.mcap").read_bytes()[:-3000])
    whole, png = tmp_path / "whole", tmp_path / "run.png"
    assert "mfba recover" in refused(capsys, "picture", str(broken), str(png))
    code, out, _ = mfba(capsys, "recover", str(broken), str(whole))
    assert code == 0
    assert f"wrote {whole}: " in out
    assert mfba(capsys, "picture", str(whole), str(png)) == (0, f"wrote {png}\n", "")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert "already exists" in refused(capsys, "picture", str(whole), str(png))
    assert "exists" in refused(capsys, "recover", str(broken), str(whole))


def test_core_commands_need_no_ros(recorded: Path, tmp_path: Path) -> None:
    program = f"""
import sys
sys.modules.update(dict.fromkeys(("rclpy", "rosgraph_msgs", "std_msgs", "nav_msgs"), None))
from mfba_planner import cli
for args in (["sim"], ["scenarios"], ["options"], ["info", {str(recorded)!r}],
             ["recover", {str(recorded)!r}, "whole"], ["picture", "whole", "run.png"],
             ["run", "--driver", "core"]):
    assert cli.main(args) == 0, args
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_terminal_gets_overwritten_progress_and_a_coloured_table(tmp_path: Path) -> None:
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format("mfba"), "run", "empty", "--no-picture"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "100"},
        stdin=subprocess.DEVNULL,
        stdout=slave,
    )
    os.close(slave)
    output = bytearray()
    try:
        while piece := os.read(master, 4096):
            output += piece
    except OSError:  # raised at the end of a terminal
        pass
    os.close(master)
    assert process.wait(60) == 0
    text = output.decode()
    assert "m to the goal, path generation" in text
    assert "\x1b[2K" in text  # the line is erased
    assert "\x1b[1;32mgoal reached" in text


def test_core_run_can_be_stopped_by_its_caller() -> None:
    episode = run(load_scenario("case1"), go_on=lambda world: world.tick < 9)
    assert (len(episode.ticks), episode.outcome.value) == (10, "interrupted")
    assert episode.ticks == run(load_scenario("case1")).ticks[:10]
