# SPDX-License-Identifier: Apache-2.0
"""`mfba compare`: files, workers, resuming, failing optimisers, errors in one line."""

import csv
import json
from pathlib import Path

import pytest

from mfba_planner import cli
from mfba_planner.cli import compare
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.evaluation.sweep import sweep_chunks
from mfba_planner.evaluation.sweep.run_sweep import sweep
from mfba_planner.evaluation.sweep.sweep_spec import SweepSpec, default_setting
from mfba_planner.paper import optimizers_on_functions

Capture = pytest.CaptureFixture[str]
SMALL = [
    "random-3", "F3", "--planner=paper", "--optimizer=mfba", "--optimizer=random",
    "--optimizer=none", "--budget=10", "--budget=25", "--worlds=6", "--runs=7",
]  # fmt: skip
SAME = ("table.csv", "comparison.json", "ranks.png", "budgets.png")


def mfba(*args: str) -> int:
    return run_and_return_exit_code(lambda: cli.main(list(args)), "mfba")


def rows(directory: Path, name: str = "table.csv") -> list[dict[str, str]]:
    with open(directory / name, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("compare") / "out"
    assert mfba("compare", *SMALL, "--workers=1", "--out", str(out)) == 0
    return out


def test_the_files_and_their_rows(compared: Path) -> None:
    names = {path.name for path in compared.iterdir()}
    assert names == {*SAME, "chunks", "study.json", "timings.csv", "report.md"}
    found = rows(compared)
    # Worlds: 3 optimisers x 2 budgets x 6; functions: without "none", 2 x 2 x 7.
    assert [row["suite"] for row in found] == ["random-3"] * 36 + ["F3"] * 28
    assert len(rows(compared, "timings.csv")) == 64
    none = [row for row in found if row["optimizer"] == "none"]
    plain = [{k: v for k, v in row.items() if k != "budget"} for row in none]
    assert plain[:6] == plain[6:]
    report = (compared / "report.md").read_text(encoding="utf-8")
    assert f"- `mfba compare {' '.join(SMALL[:2])} --optimizer mfba --optimizer random" in report
    assert "| mfba | 6 | 100.00 % [60.97, 100.00] |" in report
    data = json.loads((compared / "comparison.json").read_text())
    assert [g["verdict"] in report for g in data["groups"]] == [True] * 4
    assert "decision_us" not in json.dumps(data)


def test_rows_are_those_of_a_sweep(compared: Path) -> None:
    """With planner.optimizer and planner.bat.iterations set, decision for decision."""
    from mfba_planner.evaluation.comparison.comparison_spec import with_search

    setting = default_setting("random-3")
    params = with_search(setting.params, "random", 25)
    spec = SweepSpec(suite="random-3", planners=("paper",), worlds=6, own={"paper": params})
    assert params.bat.iterations == 4
    found = [r for r in rows(compared) if (r["optimizer"], r["budget"]) == ("random", "25")]
    expected = [(repr(row["length_m"]), repr(row["gap"])) for row in sweep(spec).rows]
    assert [(r["length_m"], r["gap"]) for r in found if r["suite"] == "random-3"] == expected


def test_the_same_for_two_workers(compared: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert mfba("compare", *SMALL, "--workers=2", "--out", str(out)) == 0
    for name in SAME:
        assert (out / name).read_bytes() == (compared / name).read_bytes(), name


@pytest.mark.filterwarnings("default")  # warnings of dask itself
def test_the_same_by_dask(compared: Path, tmp_path: Path, scheduler: str) -> None:
    out = tmp_path / "out"
    assert mfba("compare", *SMALL, "--scheduler", scheduler, "--out", str(out)) == 0
    for name in SAME:
        assert (out / name).read_bytes() == (compared / name).read_bytes(), name


def test_an_interrupted_comparison_is_resumed(
    compared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    out, computed = tmp_path / "out", list[str]()
    whole = sweep_chunks.RunsChunk.run

    def interrupted(chunk: sweep_chunks.RunsChunk) -> object:
        if len(computed) == 3:
            raise KeyboardInterrupt
        computed.append(chunk.name)
        return whole(chunk)

    with monkeypatch.context() as patch:
        patch.setattr(sweep_chunks.RunsChunk, "run", interrupted)
        assert mfba("compare", *SMALL, "--workers=1", "--out", str(out)) == 130
    assert f"interrupted; continue with --out {out}" in capsys.readouterr().err
    assert {path.name for path in out.iterdir()} == {"chunks", "study.json"}
    kept = {path: path.stat().st_mtime_ns for path in (out / "chunks").iterdir()}
    assert len(kept) == 1 + 3  # the oracle's, and three of runs
    assert mfba("compare", *SMALL, "--workers=1", "--out", str(out)) == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    for name in SAME:
        assert (out / name).read_bytes() == (compared / name).read_bytes(), name


def test_a_repeated_comparison_computes_nothing(
    compared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path: path.stat().st_mtime_ns for path in compared.rglob("*")}
    for kind in (sweep_chunks.RunsChunk, optimizers_on_functions.FunctionChunk):
        monkeypatch.setattr(kind, "run", lambda _: pytest.fail("nothing is left to do"))
    assert mfba("compare", *SMALL, "--out", str(compared)) == 0
    assert {path: path.stat().st_mtime_ns for path in compared.rglob("*")} == before


def test_a_page_is_filled(compared: Path, tmp_path: Path, capsys: Capture) -> None:
    page, images = tmp_path / "results.md", tmp_path / "images"
    again = ["compare", *SMALL, "--out", str(compared), "--update", str(page)]
    page.write_text("# Mine\n", encoding="utf-8")
    assert mfba(*again) == 1
    assert f"mfba: {page}: no block 'comparison'; add the lines" in capsys.readouterr().err
    marks = [f"<!-- {word} generated: comparison -->" for word in ("begin", "end")]
    page.write_text(f"# Mine\n\n{marks[0]}\nold\n{marks[1]}\nend\n", encoding="utf-8")
    for _ in range(2):
        assert mfba(*again) == 0
        text = page.read_text(encoding="utf-8")
        assert text.startswith(f"# Mine\n\n{marks[0]}\n- `mfba compare random-3 F3 ")
        assert text.endswith(f"{marks[1]}\nend\n")
        assert "![Ranks](images/results-ranks.png)" in text
        assert (images / "results-ranks.png").read_bytes() == (compared / SAME[2]).read_bytes()


def test_another_comparison_is_refused_in_the_same_directory(
    compared: Path, capsys: Capture
) -> None:
    args = [word.replace("=random", "=ba") for word in SMALL]
    assert mfba("compare", *args, "--out", str(compared)) == 1
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "optimizers=['mfba', 'random', 'none'], now ['mfba', 'ba', 'none']" in err


@pytest.mark.parametrize(
    ("name", "in_world", "on_function"),
    [
        ("NoPoints", "raised OptimizerError: optimizer faulty_", "ask() returned no points"),
        ("Endless", "hung: no end after 2 s of wall time", "hung: no end after 2 s of wall time"),
    ],
)
def test_a_failing_optimizer_marks_its_runs_and_the_comparison_goes_on(
    name: str, in_world: str, on_function: str, tmp_path: Path
) -> None:
    out, failing = tmp_path / "out", f"faulty_optimizers:{name}"
    args = ["random-3", "F1", "--planner=paper", "--optimizer=random", f"--optimizer={failing}"]
    args += ["--worlds=2", "--runs=2", "--budget=10", "--patience=2", "--workers=1"]
    assert mfba("compare", *args, "--no-oracle", "--out", str(out)) == 0
    failed = [row for row in rows(out) if row["optimizer"] == failing]
    assert [row["outcome"] for row in failed] == ["failed"] * 4
    assert [in_world in row["failure"] for row in failed] == [True, True, False, False] or (
        in_world == on_function
    )
    assert [on_function in row["failure"] for row in failed[2:]] == [True, True]
    assert [row["error"] for row in failed] == ["", "", "inf", "inf"]
    sound = [row["outcome"] for row in rows(out) if row["optimizer"] == "random"]
    assert sound == ["goal_reached"] * 2 + ["searched"] * 2
    report = (out / "report.md").read_text(encoding="utf-8")
    assert f"- {failing}: 2 x " in report
    assert "2 cases are too few for a verdict" in report


@pytest.mark.parametrize(
    ("args", "reason"),
    [
        (["random-33"], "'random-33': no such suite or function; did you mean 'random-3"),
        (["F7"], "'F7': no such suite or function; did you mean 'F"),
        (["--optimizer=mfba", "--optimizer=randon"], "unknown; did you mean 'random'?"),
        (["--optimizer=mfba"], "--optimizer mfba: one alone; give at least two"),
        (["--optimizer=ba", "--optimizer=ba"], "--optimizer ba: given twice; give each once"),
        (["--against=gird"], "--against gird: not compared; did you mean 'grid'?"),
        (["F1", "--optimizer=ba", "--optimizer=none"], "F1: only ba searches a function;"),
        (["paper", "paper"], "suite paper: given twice"),
        (["--budget=27"], "--budget=27: not two or more times the population of 5; give 25"),
        (["F1", "--budget=27"], "--budget=27: not two or more times the population of 5"),
        (["F1", "--runs=0"], "--runs=0: out of range"),
        (["--budget=25", "--budget=25"], "--budget 25: given twice"),
        (["paper", "--worlds=0"], "--worlds=0: out of range"),
        (["F1", "--patience=0"], "--patience=0: out of range"),
        (["--set=planner.optimizer=ba"], "a comparison varies it; give --optimizer"),
        (["--set=planner.bat.iterations=9"], "a comparison varies it; give --budget"),
        (["--set=planner.speed=1"], "did you mean 'planner.speed_mps'?"),
        (["--planner=dwa"], "--planner: invalid choice: 'dwa'"),
        (["--workers=0"], "--workers=0: out of range"),
        (["--optimizer=ba", "--optimizer=no_module:X"], "no_module"),
    ],
)
def test_mistakes_give_one_line_and_leave_nothing(
    args: list[str], reason: str, capsys: Capture, tmp_path: Path
) -> None:
    assert mfba("compare", "--out", str(tmp_path / "out"), *args) == 1
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1), err
    assert reason in err
    assert not (tmp_path / "out").exists()


def test_a_setting_holds_for_every_arm_and_its_oracle(tmp_path: Path) -> None:
    out = tmp_path / "out"
    args = ["random-3", "--optimizer=ba", "--optimizer=none", "--budget=10", "--worlds=1"]
    args += ["--planner=paper", "--planner=predictive", "--set=planner.speed_mps=0.5"]
    assert mfba("compare", *args, "--workers=1", "--out", str(out)) == 0
    assert "perception lidar, robot 0.5 m/s" in (out / "report.md").read_text(encoding="utf-8")
    found = rows(out)
    assert len(found) == 4
    for row in found:
        assert float(row["length_m"]) / float(row["time_s"]) < 0.55
    assert len({row["optimum_m"] for row in found}) == 1


def test_the_default_is_the_whole_comparison() -> None:
    spec, functions = compare._specs(compare._parser().parse([]))
    names = [sweep.suite for sweep in spec.sweeps]
    assert names == ["paper", "random-10", "random-20", "random-30", "fast-10", "rooms", "crowd"]
    assert {(sweep.worlds, sweep.planners) for sweep in spec.sweeps} == {
        (500, ("paper", "predictive"))
    }
    assert spec.budgets == functions.budgets == (25, 150, 1000)
    assert (functions.functions, functions.seeds) == (("F1", "F2", "F3", "F4", "F5", "F6"), 500)
    chunks = [*spec.chunks(), *functions.chunks()]
    assert len({chunk.name for chunk in chunks}) == len(chunks)
    presets = {arm.planner: spec.sweep_of(arm).setting.params for arm in spec.arms()}
    # Each planner keeps its own step.
    assert presets["paper"].step_length_m > 3 * presets["predictive"].step_length_m


def test_functions_alone_and_suites_alone(tmp_path: Path) -> None:
    common = ["--optimizer=ba", "--optimizer=grid", "--budget=10", "--workers=1"]
    out = tmp_path / "functions"
    assert mfba("compare", "F6", "F2", *common, "--runs=3", "--out", str(out)) == 0
    assert [row["suite"] for row in rows(out)] == ["F6"] * 6 + ["F2"] * 6
    out = tmp_path / "suite"
    assert mfba("compare", "paper", *common, "--worlds=2", "--out", str(out)) == 0
    assert {row["planner"] for row in rows(out)} == {"paper", "predictive"}
    assert "2 worlds (2 different ones" in (out / "report.md").read_text(encoding="utf-8")
