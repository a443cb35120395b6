# SPDX-License-Identifier: Apache-2.0
"""`mfba sweep` and `mfba show`: output, errors in one line, and interrupts."""

import csv
import os
import re
import signal
from dataclasses import replace
from pathlib import Path

import pytest
from launched_programs import Program, complete
from waiting import wait_until

from mfba_planner import cli
from mfba_planner.cli.sweep import command_line
from mfba_planner.core.errors import ConfigError
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.evaluation.suites.named_suites import SPEED_MPS
from mfba_planner.evaluation.sweep import sweep_chunks as sweep_chunks
from mfba_planner.evaluation.sweep.run_sweep import sweep
from mfba_planner.evaluation.sweep.sweep_spec import Run, Setting, SweepSpec, default_setting
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.read_episode import read_episode

Capture = pytest.CaptureFixture[str]
HASH = re.compile(r"^sorted hash ([0-9a-f]{64})$", re.MULTILINE)
STRAIGHT = ["sweep", "random-3", "--planner", "straight", "--no-oracle", "--perception", "known"]
LONG = [*STRAIGHT, "--worlds", "2000"]
SMALL = ["random-3", "--planner", "paper", "--planner", "straight", "--worlds", "4"]


def mfba(*args: str) -> int:
    return run_and_return_exit_code(lambda: cli.main(list(args)), "mfba")


def refused(capture: Capture, *args: str) -> str:
    """Run a command that fails; return its one line of error."""
    code = mfba(*args)
    out, err = capture.readouterr()
    assert (code, out, err.count("\n")) == (1, "", 1), err
    return err


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory of eight runs; some of `straight` collide."""
    out = tmp_path_factory.mktemp("sweep") / "out"
    assert mfba("sweep", *SMALL, "--workers", "1", "--out", str(out)) == 0
    return out


def rows(directory: Path) -> list[dict[str, str]]:
    with open(directory / "table.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_default_planner_is_predictive(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert mfba("sweep", "random-3", "--worlds", "1", "--workers", "1", "--out", str(out)) == 0
    assert [row["planner"] for row in rows(out)] == ["predictive"]


def test_a_sweep_writes_table_timings_report_and_chunks(swept: Path) -> None:
    assert {path.name for path in swept.iterdir()} == {
        "chunks", "report.md", "study.json", "table.csv", "timings.csv",
    }  # fmt: skip
    assert len(rows(swept)) == 8
    report = (swept / "report.md").read_text(encoding="utf-8")
    assert "`mfba sweep random-3 --planner paper --planner straight --worlds 4`" in report
    spec = SweepSpec(suite="random-3", planners=("paper", "straight"), worlds=4)
    assert f"sorted hash of the table `{sweep(spec).hash}`" in report
    assert re.search(r"^\| paper \| 4 \| 100\.00 % \[51\.01, 100\.00\] \|", report, re.MULTILINE)


def test_a_repeated_sweep_computes_nothing_and_prints_the_same(
    swept: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path: path.stat().st_mtime_ns for path in swept.rglob("*")}
    monkeypatch.setattr(
        sweep_chunks.RunsChunk, "run", lambda _: pytest.fail("nothing is left to do")
    )
    monkeypatch.setattr(
        sweep_chunks.OracleChunk, "run", lambda _: pytest.fail("nothing is left to do")
    )
    assert mfba("sweep", *SMALL, "--out", str(swept)) == 0
    out, err = capsys.readouterr()
    assert {path: path.stat().st_mtime_ns for path in swept.rglob("*")} == before
    assert HASH.search(out)
    assert err == ""


def test_a_half_written_chunk_is_computed_again(swept: Path, capsys: Capture) -> None:
    chunk = swept / "chunks/random-3-straight-0-4.json"
    table, whole = (swept / "table.csv").read_bytes(), chunk.read_bytes()
    chunk.write_bytes(whole[: len(whole) // 2])
    for name in ("timings.csv", "report.md"):  # computing times differ
        (swept / name).unlink()
    assert mfba("sweep", *SMALL, "--out", str(swept)) == 0
    assert (swept / "table.csv").read_bytes() == table


def test_a_half_written_table_is_refused(swept: Path, capsys: Capture) -> None:
    path = swept / "table.csv"
    whole = path.read_bytes()
    path.write_bytes(whole[:200])
    assert mfba("sweep", *SMALL, "--out", str(swept)) == 1
    assert "table.csv: differs from the finished runs" in capsys.readouterr().err
    path.unlink()
    assert mfba("sweep", *SMALL, "--out", str(swept)) == 0
    assert path.read_bytes() == whole


@pytest.mark.parametrize(
    ("args", "reason"),
    [
        (["random-33"], "'random-33': no such suite; did you mean 'random-3"),
        (["paper", "--planner", "straigth"], "did you mean 'straight'?"),
        (["paper", "--worlds", "0"], "--worlds=0: out of range"),
        (["paper", "--seeds", "3"], "leave out --seeds"),
        (["paper", "--workers", "0"], "--workers=0: out of range"),
        (["paper", "--noise", "-1"], "noise_m=-1.0"),
        (["paper", "--latency", "-1"], "latency_ticks=-1"),
        (["paper", "--patience", "nan"], "--patience=nan: out of range"),
        (["paper", "--perception", "sonar"], "--perception: invalid choice: 'sonar'"),
        (["paper", "--format", "xls"], "--format: invalid choice: 'xls'"),
        (["paper", "--set", "planner.speed=1"], "did you mean 'planner.speed_mps'?"),
        (["paper", "--set", "planner.speed_mps=-1"], "speed_mps=-1"),
        (["paper", "--plannner", "paper"], "did you mean '--planner'?"),
        ([], "required: SUITE"),
    ],
)
def test_mistakes_give_one_line(args: list[str], reason: str, capsys: Capture) -> None:
    assert reason in refused(capsys, "sweep", *args)


def test_an_unreachable_scheduler_gives_one_line(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mfba_planner.evaluation.sweep.run_sweep.CONNECT_S", 1)
    monkeypatch.chdir(tmp_path)
    assert mfba("sweep", "paper", "--scheduler", "tcp://127.0.0.1:9") == 1
    assert "--scheduler tcp://127.0.0.1:9: cannot be reached" in capsys.readouterr().err


def test_a_directory_with_other_files_is_not_changed(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    assert "no results of `mfba sweep`" in refused(capsys, "sweep", *SMALL, "--out", str(tmp_path))
    assert os.listdir(tmp_path) == ["mine.txt"]


def test_parquet(tmp_path: Path, capsys: Capture) -> None:
    from pyarrow import parquet

    out = tmp_path / "out"
    args = ["--worlds", "2", "--no-oracle", "--format", "parquet", "--workers", "1"]
    assert mfba("sweep", "random-3", *args, "--out", str(out)) == 0
    table = parquet.read_table(out / "table.parquet").to_pylist()
    assert [(row["world"], row["certificate"], row["gap"]) for row in table] == [
        (0, "", None), (1, "", None),
    ]  # fmt: skip


def test_the_command_line_of_a_report_gives_the_same_sweep() -> None:
    setting = Setting(
        params=PlannerParams(speed_mps=0.5, step_length_m=0.1),
        perception="scan-12",
        noise_m=0.02,
        latency_ticks=1,
        suite_seed=7,
        patience_s=9.0,
    )
    spec = SweepSpec(
        suite="dense", planners=("paper", "ba"), worlds=3, first=4, seeds=2, oracle=False,
        setting=setting,
    )  # fmt: skip
    words = command_line(spec).split()
    assert words[:2] == ["mfba", "sweep"]
    from mfba_planner.cli.sweep import _parser, _sweep_spec

    assert _sweep_spec(_parser().parse(words[2:]))[0] == spec


def test_the_command_line_names_a_changed_robot() -> None:
    from mfba_planner.cli.sweep import _parser, _sweep_spec

    args = [
        "random-3", "--planner", "predictive", "--worlds", "1",
        "--set", "robot.reverse=false", "--set", "robot.lidar.fov_rad=4.7",
    ]  # fmt: skip
    spec = _sweep_spec(_parser().parse(args))[0]
    assert command_line(spec) == "mfba sweep " + " ".join(args)
    robot = spec.setting.scenario(Run("random-3", 0, "predictive", 0)).robot
    assert (robot.reverse, robot.lidar.fov_rad, robot.lidar.beams) == (False, 4.7, 360)
    with pytest.raises(ConfigError, match="--perception sectors has no robot; give one of lidar"):
        _sweep_spec(_parser().parse([*args, "--perception", "sectors"]))


def test_predictive_has_its_own_step_and_swarm_unless_others_are_given() -> None:
    from mfba_planner.cli.sweep import _parser, _sweep_spec

    args = ["random-3", "--planner", "paper", "--planner", "predictive", "--worlds", "1"]
    spec = _sweep_spec(_parser().parse(args))[0]
    usual = PlannerParams(speed_mps=SPEED_MPS)
    assert spec.setting_of("paper").params == usual
    assert spec.setting_of("predictive").params == preset(usual)
    assert command_line(spec) == "mfba sweep " + " ".join(args)
    args += ["--set", "planner.step_length_m=0.3"]
    spec = _sweep_spec(_parser().parse(args))[0]
    assert spec.setting_of("paper").params == usual
    assert spec.setting_of("predictive").params == replace(preset(usual), step_length_m=0.3)
    assert command_line(spec) == "mfba sweep " + " ".join(args)


def test_a_suite_s_speed_and_the_lidar_are_the_defaults() -> None:
    from mfba_planner.cli.sweep import _parser, _sweep_spec

    args = ["fast-10", "--planner", "orca", "--worlds", "1"]
    spec = _sweep_spec(_parser().parse(args))[0]
    assert (spec.setting.params.speed_mps, spec.setting.perception) == (1.0, "lidar")
    assert command_line(spec) == "mfba sweep " + " ".join(args)
    args += ["--perception", "known", "--set", "planner.speed_mps=0.8"]
    spec = _sweep_spec(_parser().parse(args))[0]
    assert (spec.setting.params.speed_mps, spec.setting.perception) == (0.8, "known")
    assert command_line(spec) == "mfba sweep " + " ".join(args)


def test_help_says_which_perceptions_hold_the_sensing_range_equal() -> None:
    from mfba_planner.cli.sweep import _parser

    text = " ".join(_parser().format_help().split())
    for words in ("see no farther than SR, to hold SR equal", "known: told the truth",
                  "lidar-realistic: that with errors: ranges 2 cm"):  # fmt: skip
        assert words in text


def interrupted(out: Path, tmp_path: Path, send: signal.Signals, *, group: bool) -> Program:
    """A sweep that is stopped when some of its chunks are finished."""
    with Program("mfba", *LONG, "--workers", "2", "--out", str(out), cwd=tmp_path) as program:
        chunks = out / "chunks"
        wait_until(lambda: chunks.is_dir() and len(list(chunks.glob("*.json"))) >= 2, 120.0)
        if group:  # as a terminal does: workers and their children get it too
            program.send_group(send)
        else:
            program.process.send_signal(send)
        program.end()
        wait_until(lambda: program.processes() == [], 20.0)
        return program


def hash_of_straight(worlds: int) -> str:
    """The hash of a sweep with STRAIGHT, computed in this process."""
    setting = replace(default_setting("random-3"), perception="known")
    spec = SweepSpec(
        suite="random-3", planners=("straight",), worlds=worlds, oracle=False, setting=setting
    )
    return sweep(spec).hash


def finished(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (out / "chunks").glob("*.json")}


@pytest.mark.no_cover
def test_after_ctrl_c_a_sweep_continues(tmp_path: Path) -> None:
    out = tmp_path / "out"
    program = interrupted(out, tmp_path, signal.SIGINT, group=True)
    assert program.process.returncode == 130
    assert program.stderr == f"interrupted; continue with --out {out}\n"
    kept = finished(out)
    assert 2 <= len(kept) < 20
    assert not (out / "table.csv").exists()
    assert not list(out.rglob("*.tmp"))
    again = complete("mfba", *LONG, "--workers", "1", "--out", str(out), cwd=tmp_path)
    assert again.process.returncode == 0, again.stderr
    after = finished(out)
    assert len(after) == 20
    assert {name: after[name] for name in kept} == kept, "finished chunks are not computed again"
    found = HASH.search(again.stdout)
    assert found
    assert found.group(1) == hash_of_straight(2000)


def test_a_killed_sweep_leaves_no_process(tmp_path: Path) -> None:
    interrupted(tmp_path / "out", tmp_path, signal.SIGKILL, group=False)


@pytest.mark.no_cover
def test_one_worker_killed_is_named_and_the_sweep_continues(tmp_path: Path) -> None:
    out = tmp_path / "out"
    args = [*STRAIGHT, "--worlds", "1000", "--workers", "2", "--out", str(out)]
    with Program("mfba", *args, cwd=tmp_path) as program:
        wait_until(lambda: len(_workers(program)) == 2, 60.0)
        os.kill(_workers(program)[0], signal.SIGKILL)
        assert program.end() == 0, program.stderr
    assert "its worker process may have died; running it again alone" in program.stderr
    found = HASH.search(program.stdout)
    assert found
    assert found.group(1) == hash_of_straight(1000)


def _workers(program: Program) -> list[int]:
    """PIDs of the pool's workers, without their child processes."""
    return [
        pid
        for pid in program.processes()
        if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    ]


# --- mfba show --------------------------------------------------------------------------------


def a_collision(swept: Path) -> tuple[int, dict[str, str]]:
    return next((k, row) for k, row in enumerate(rows(swept)) if int(row["collisions"] or 0))


def test_a_failed_run_becomes_text_pictures_and_a_bag(
    swept: Path, tmp_path: Path, capsys: Capture
) -> None:
    number, row = a_collision(swept)
    name = f"random-3/{row['world']}/straight/0"
    assert mfba("show", str(swept), str(number), "--out", str(tmp_path / "a")) == 0
    out = capsys.readouterr().out
    assert out.startswith(f"{name}\nthe robot ran into obstacle {row['first_contact_with']} at ")
    assert f"at {float(row['first_contact_s']):.2f} s" in out
    assert "known: within SR (0.8 m) since tick" in out
    assert "straight to the goal" in out
    assert "oracle: feasible at 0.8 m/s" in out
    assert "note:" not in out
    assert {path.name for path in (tmp_path / "a").iterdir()} == {
        "bag", "explanation.txt", "moment.png", "run.png",
    }  # fmt: skip
    for picture in ("run.png", "moment.png"):
        assert (tmp_path / "a" / picture).read_bytes().startswith(b"\x89PNG")
    episode = read_episode(tmp_path / "a/bag")
    assert len(episode.ticks) == int(row["ticks"])
    assert mfba("show", str(swept), name, "--no-bag", "--out", str(tmp_path / "b")) == 0
    assert (tmp_path / "b/explanation.txt").read_text() == (
        tmp_path / "a/explanation.txt"
    ).read_text()


@pytest.mark.parametrize("planner", ["paper", "predictive"])
def test_a_bag_of_a_run_can_be_verified(tmp_path: Path, capsys: Capture, planner: str) -> None:
    """Of predictive, with the scans that it tracked obstacles in."""
    assert mfba("show", f"random-10/1/{planner}/0", "--out", str(tmp_path / "a")) == 0
    assert "goal reached without collision" in capsys.readouterr().out
    assert mfba("verify", str(tmp_path / "a"), "--closed-loop") == 0
    assert "closed loop: identical" in capsys.readouterr().out


def test_runs_without_success_are_listed(swept: Path, capsys: Capture) -> None:
    failed = [k for k, row in enumerate(rows(swept)) if row["success"] == "false"]
    assert mfba("show", str(swept)) == 0
    out = capsys.readouterr().out
    assert out.startswith(f"{len(failed)} of 8 runs without success\n")
    assert [int(line.split()[0]) for line in out.splitlines()[1:]] == failed


@pytest.mark.parametrize(
    ("planner", "line"),
    [
        ("Raises", "the planner failed at tick 5: raised ValueError: no idea what to do"),
        ("Sleeps", "the planner failed at tick 5: hung: no end after 1 s of wall time"),
    ],
)
def test_a_failure_of_a_planner_is_shown(
    planner: str, line: str, tmp_path: Path, capsys: Capture
) -> None:
    out = tmp_path / "out"
    args = ["--planner", f"faulty_planners:{planner}", "--worlds", "1", "--no-oracle"]
    args += ["--patience", "1", "--workers", "1"]
    assert mfba("sweep", "random-3", *args, "--out", str(out)) == 1
    assert "1 x " in (out / "report.md").read_text()
    reason = line.partition("at tick 5: ")[2].removeprefix("hung: ")
    printed = capsys.readouterr()
    assert f"faulty_planners:{planner} failed in 1 of 1 runs: {reason}\n" in printed.out
    assert printed.err.count("\n") == 1
    assert f"faulty_planners:{planner} failed in each of its 1 runs: {reason}; see " in printed.err
    beside = [*args, "--planner", "straight", "--out", str(tmp_path / "both")]
    assert mfba("sweep", "random-3", *beside) == 1, "a planner that never works is no result"
    capsys.readouterr()
    assert mfba("show", str(out), "0", "--out", str(tmp_path / "shown")) == 0
    output = capsys.readouterr().out
    assert line in output
    assert "straight to the goal" in output, "the last executed decisions"
    assert len(read_episode(tmp_path / "shown/bag").ticks) == 5


def test_a_run_that_did_not_reach_the_goal(tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "out"
    args = [
        "--set",
        "planner.speed_mps=0.1",
        "--worlds",
        "1",
        "--no-oracle",
        "--workers",
        "1",
    ]
    assert mfba("sweep", "random-3", *args, "--out", str(out)) == 0
    capsys.readouterr()
    assert mfba("show", str(out), "0", "--no-bag", "--out", str(tmp_path / "shown")) == 0
    output = capsys.readouterr().out
    assert re.search(r"m left to the goal when time was up \(1\d\d\.\d s\)", output)
    assert "modes: " in output


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["nowhere"], "nowhere: no such directory"),
        (["random-3/0/paper"], "random-3/0/paper: no such directory"),
        (["7"], "7: no run; give SUITE/WORLD/PLANNER/SEED"),
        (["random-4/0/paper/0"], "'random-4': no such suite"),
        (["random-3/0/papre/0"], "did you mean 'paper'?"),
        (["random-3/0/paper/0", "1"], "1: one argument too many"),
        ([], "required: DIR | RUN"),
    ],
)
def test_mistakes_of_show_give_one_line(words: list[str], reason: str, capsys: Capture) -> None:
    assert reason in refused(capsys, "show", *words)


def test_runs_that_a_sweep_does_not_have(swept: Path, tmp_path: Path, capsys: Capture) -> None:
    assert "8: the table has 8 rows" in refused(capsys, "show", str(swept), "8")
    other = "random-3/9/paper/0"
    assert f"{other}: not a run of this sweep" in refused(capsys, "show", str(swept), other)
    assert "no results of `mfba sweep`" in refused(capsys, "show", str(tmp_path))
    taken = ["show", str(swept), "0", "--out", str(tmp_path)]
    assert "exists and is never overwritten" in refused(capsys, *taken)


def test_a_directory_of_something_else_is_not_an_output(tmp_path: Path, capsys: Capture) -> None:
    """The directory is the input of show; of sweep it is --out."""
    (tmp_path / "run.png").touch()
    missing = f"{tmp_path}: no results of `mfba sweep` (study.json is missing); "
    assert f"{missing}give one that `mfba sweep` has made" in refused(
        capsys, "show", str(tmp_path)
    )
    (tmp_path / "study.json").write_text("{", encoding="utf-8")
    assert "not JSON; give one that `mfba sweep` has" in refused(capsys, "show", str(tmp_path))
