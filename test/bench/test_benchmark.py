# SPDX-License-Identifier: Apache-2.0
"""bench/benchmark.py: its tables match the rows; docs/benchmark.md matches its commands."""

import json
import os
import re
import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shown_commands
from project import ROOT

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.evaluation.suites import suite as suite_of
from mfba_planner.evaluation.suites import suite_names
from mfba_planner.evaluation.sweep.read_sweep import read_sweep
from mfba_planner.planning.peers.dwa import DynamicWindow
from mfba_planner.report.sweep_tables import HEAD

SCRIPT = ROOT / "bench" / "benchmark.py"
PAGE = (ROOT / "docs" / "benchmark.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
MARKS = ("<!-- bench/benchmark.py: begin -->\n", "<!-- bench/benchmark.py: end -->\n")
SHOWN = shown_commands.commands(PAGE)
WHOLE, MADE_BY = (words for words in SHOWN if words[0] == "python")
SMALL = shown_commands.reduced(MADE_BY)[2:]
SIX = ("paper", "predictive", "orca", "dwa", "vfh", "apf")
# Each from a lidar, as a realistic robot, and with circles known; one senses nothing.
ROWS = [f"{name}{how}" for name in SIX for how in ("", ", realistic", ", known")] + ["straight"]
STORED = json.loads((ROOT / "docs" / "benchmark.json").read_text(encoding="utf-8"))
IN_THE_OPEN = [name for name in suite_names() if suite_of(name).in_the_open]
OUT = Path("runs/benchmark")


def bench(words: list[str], directory: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPT), *words],
        cwd=directory,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=600,
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory in which the benchmark of one suite has been made, two worlds of it."""
    directory = tmp_path_factory.mktemp("benchmark")
    (directory / "docs").mkdir()
    (directory / "docs" / "benchmark.md").write_text(PAGE, encoding="utf-8")
    (directory / "README.md").write_text(f"above\n{MARKS[0]}old\n{MARKS[1]}below\n")
    found = bench(SMALL, directory)
    assert found.returncode == 0, found.stderr
    return directory


def lines(page: str, title: str) -> dict[str, dict[str, str]]:
    """The table below a title: {first cell: {head: cell}}."""
    table = page.partition(f"{title}\n")[2].partition("\n|")[2].partition("\n\n")[0]
    cells = [[c.strip() for c in row.strip("|").split("|")] for row in table.splitlines()]
    return {row[0]: dict(zip(cells[0], row)) for row in cells[2:]}


def test_the_tables_hold_what_the_rows_hold(made: Path) -> None:
    page = (made / "docs" / "benchmark.md").read_text(encoding="utf-8")
    found = lines(page, "### random-20")
    assert list(found) == ROWS
    (optima,) = (
        json.loads(path.read_text())["columns"]
        for path in (made / OUT / "random-20-optima" / "chunks").glob("*.json")
    )
    optimum_m = dict(zip(optima["world"], optima["optimum_m"]))
    for name, line in found.items():
        assert list(line) == list(HEAD)
        rows = read_sweep(made / OUT / f"random-20-{name.replace(', ', '--')}").rows
        assert [row["world"] for row in rows] == [10184, 10185]
        good = [row for row in rows if row["success"]]
        assert line["success"].startswith(f"{50.0 * len(good):.2f} % ["), name
        assert line["collided"] == str(sum(row["collisions"] > 0 for row in rows))
        if good:
            gaps = [row["length_m"] / optimum_m[row["world"]] - 1.0 for row in good]
            assert line["gap"].startswith(f"{100.0 * sum(gaps) / len(gaps):.2f} % ["), name
            assert line["time s"].startswith(f"{sum(r['time_s'] for r in good) / len(good):.2f} [")


def stored_cell(name: str, figures: dict[str, Any]) -> dict[str, str]:
    """The cells of the page's table that the stored figures of a row say, as far as they do."""
    cells = {"planner": name, "runs": str(figures["runs"]), "collided": str(figures["collided"])}
    for head in ("success", "gap"):
        cells[head] = shares(figures[head])
    cells["certified"] = f"{shares(figures['certified'])} of {figures['certified_runs']}"
    return cells


def shares(interval: list[float] | None) -> str:
    if interval is None:
        return "-"
    middle, low, high = (100.0 * value for value in interval)
    return f"{middle:.2f} % [{low:.2f}, {high:.2f}]"


def close(found: str, expected: str) -> bool:
    """The same words, and numbers that differ by no more than the rounding of the stored ones."""
    number = re.compile(r"-?\d+\.\d+")
    if number.sub("#", found) != number.sub("#", expected):
        return False
    pairs = zip(number.findall(found), number.findall(expected))
    return all(abs(float(a) - float(b)) < 0.0101 for a, b in pairs)


def assert_is_stored(page: str, stored: dict[str, Any]) -> None:
    """The page's tables of suites have the stored figures, row by row."""
    for suite, figures in stored["suites"].items():
        if suite == "paper":
            continue  # the page has both cases apart
        found = lines(page, f"### {suite}")
        assert list(found) == ROWS == list(figures["planners"])
        for name, one in figures["planners"].items():
            for head, expected in stored_cell(name, one).items():
                assert close(found[name][head], expected), (suite, name, head)


def test_the_page_is_that_of_the_stored_results() -> None:
    assert list(STORED["suites"]) == IN_THE_OPEN
    assert f"\n{STORED['command']}\n" in PAGE
    assert_is_stored(PAGE, STORED)


def test_the_readme_s_table_is_that_of_the_stored_results(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """To the last character; and by hand, from the file alone."""
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    with_table: Any = runpy.run_path(str(SCRIPT.parent / "benchmark_results.py"))["with_table"]
    assert README.count(MARKS[0]) == README.count(MARKS[1]) == 1
    assert with_table(README, STORED) == README
    table = README.partition(MARKS[0])[2].partition(MARKS[1])[0].splitlines()
    heads = [cell.strip().replace("`", "") for cell in table[0].strip("|").split("|")]
    assert {"predictive", "predictive, realistic", "predictive, known", "orca"} <= set(heads)
    (row,) = [line for line in table if " x 20 obstacles" in line]
    cells = dict(zip(heads, (cell.strip() for cell in row.strip("|").split("|"))))
    for name in heads[1:]:
        figures = STORED["suites"]["random-20"]["planners"][name]
        success, gap = (float(number) for number in re.findall(r"-?[\d.]+", cells[name]))
        assert success == pytest.approx(100.0 * figures["certified"][0], rel=1e-3)
        assert gap == pytest.approx(100.0 * figures["gap"][0], abs=0.006)


def test_the_benchmark_stores_its_figures_and_writes_the_readme_s_table(made: Path) -> None:
    stored = json.loads((made / "docs" / "benchmark.json").read_text(encoding="utf-8"))
    assert_is_stored((made / "docs" / "benchmark.md").read_text(encoding="utf-8"), stored)
    readme = (made / "README.md").read_text(encoding="utf-8")
    assert readme.startswith(f"above\n{MARKS[0]}| worlds | `paper` |")
    assert readme.endswith(f"{MARKS[1]}below\n")
    assert "2 x 20 obstacles |" in readme
    assert "old" not in readme


def test_rows_differ_in_what_the_planner_perceives_and_in_nothing_else(made: Path) -> None:
    for name in SIX:
        settings = [
            read_sweep(made / OUT / f"random-20-{name}{how}").spec.setting
            for how in ("", "--realistic", "--known")
        ]
        assert [s.perception for s in settings] == ["lidar", "lidar-realistic", "known"]
        assert len({replace(s, perception="known") for s in settings}) == 1


def test_paper_has_its_own_step_and_all_others_share_one(made: Path) -> None:
    steps = {
        path.name: read_sweep(path).spec.setting.params.step_length_m
        for path in (made / OUT).iterdir()
        if not path.name.endswith("optima")
    }
    of_paper = {f"random-20-paper{how}" for how in ("", "--realistic", "--known")}
    assert len(steps) == len(ROWS) + 5 + 8  # with those of perceptions and of ingredients
    assert {name for name, step in steps.items() if step != 0.08} == of_paper
    assert {steps[name] for name in of_paper} == {0.3}


def test_ingredients_and_perceptions_share_what_is_the_same_run(made: Path) -> None:
    page = (made / "docs" / "benchmark.md").read_text(encoding="utf-8")
    suite = lines(page, "### random-20")
    perceptions = lines(page, "## What predictive sees")
    bought = lines(page, "## What each ingredient buys, circles known")
    assert len(perceptions) == 8
    assert len(bought) == 10
    for same, row in (
        (perceptions["random-20: lidar"], "predictive"),
        (perceptions["random-20: lidar-realistic"], "predictive, realistic"),
        (perceptions["random-20: known within SR"], "predictive, known"),
        (bought["random-20: all (predictive)"], "predictive, known"),
    ):
        assert {**same, "planner": row} == suite[row]


def test_episodes_per_minute_are_of_whole_sweeps(made: Path) -> None:
    page = (made / "docs" / "benchmark.md").read_text(encoding="utf-8")
    targets = lines(page, "## Targets")
    for name in ("paper, known", "predictive, known"):
        found_cell = targets[f"episodes per minute, {name}, random-10, workers: 1"]["found"]
        found, low, high = map(float, re.findall(r"\d+", found_cell)[:3])
        # Two short runs, and half a second to start a process for them.
        assert 10.0 < low <= found <= high < 2 * 60.0 / 0.01
        assert "in 3 sweeps" in found_cell


def test_a_decision_is_timed_again_and_again_and_in_turn(made: Path) -> None:
    page = (made / "docs" / "benchmark.md").read_text(encoding="utf-8")
    targets, costs = lines(page, "## Targets"), lines(page, "## What a decision costs")
    repeated = targets["median us of a predictive decision, 10 in range, again and again"]
    turn = targets["the same in turn with the other planners"]
    assert float(turn["found"]) == pytest.approx(float(costs["10"]["predictive, us"]), abs=0.5)
    assert f"`predictive` takes {float(repeated['found']):.0f} us with 10 in range" in page
    for row in (repeated, turn):
        assert row["target"] == "<= 300"
        assert row[""] == ("met" if float(row["found"]) <= 300.0 else "**missed**")


def test_what_was_written_by_hand_stays_and_pictures_are_small(made: Path) -> None:
    page = (made / "docs" / "benchmark.md").read_text(encoding="utf-8")
    assert page.partition("<!-- generated")[0] == PAGE.partition("<!-- generated")[0]
    assert " --worlds 2 --first 10184 --others 2 --few 2 --out runs/benchmark " in page
    named = re.findall(r"!\[.*?\]\((.*?)\)", page.partition("<!-- generated")[2])
    assert len(named) >= 3
    for name in named:
        assert 1000 < (made / "docs" / name).stat().st_size < 200_000


def test_it_goes_on_from_what_is_finished(made: Path) -> None:
    chunks = sorted((made / OUT).glob("*/chunks/*.json"))
    before = {path: path.stat().st_mtime_ns for path in chunks}
    gone = made / OUT / "random-20-orca--realistic" / "chunks"
    for path in gone.iterdir():
        del before[path]
        path.unlink()
    found = bench(SMALL, made)
    assert found.returncode == 0, found.stderr
    assert len(list(gone.iterdir())) == 1
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_verdicts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    verdict: Any = runpy.run_path(str(SCRIPT.parent / "benchmark_page.py"))["verdict"]
    assert verdict(Interval(0.999, 0.99, 1.0), 0.999, at_least=True).startswith("met, but")
    assert verdict(Interval(0.9995, 0.9991, 1.0), 0.999, at_least=True) == "met"
    assert "missed" in verdict(Interval(0.998, 0.99, 1.0), 0.999, at_least=True)
    assert verdict(Interval(0.01, 0.005, 0.012), 0.012, at_least=False) == "met"
    assert verdict(Interval(0.01, 0.005, 0.013), 0.012, at_least=False).startswith("met, but")
    assert "missed" in verdict(Interval(0.0121, 0.005, 0.013), 0.012, at_least=False)


def test_bad_scales_and_pages_are_refused_before_any_work(tmp_path: Path) -> None:
    few = bench([*SMALL, "--few", "1"], tmp_path)
    assert few.returncode == 2
    assert "give at least 2" in few.stderr
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "benchmark.md").write_text("no marks")
    marks = bench(SMALL, tmp_path)
    assert marks.returncode == 1
    assert "benchmark.md: lacks the lines" in marks.stderr
    assert not (tmp_path / OUT).exists()


def test_all_suites_are_made_by_the_command_shown_but_for_its_numbers(tmp_path: Path) -> None:
    """And for the lengths of its trips, here and in the processes of its workers."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "benchmark.md").write_text(PAGE, encoding="utf-8")
    assert shown_commands.reduced(WHOLE) != WHOLE
    short = ROOT / "test" / "helpers" / "short_trips"
    shown_commands.script(shown_commands.reduced(WHOLE), tmp_path, short)
    page = (tmp_path / "docs" / "benchmark.md").read_text(encoding="utf-8")
    for suite in IN_THE_OPEN:
        labels = lines(page, f"### {suite}")  # of suites with cases: "case 1: orca"
        assert {re.sub("^case .: ", "", label) for label in labels} == set(ROWS)
    assert PAGE.count("\n### ") == page.count("\n### ")
    assert PAGE.count("\n## ") == page.count("\n## ")


@pytest.mark.parametrize("command", [w for w in SHOWN if w[0] != "python"], ids=lambda w: w[-1])
def test_the_runs_shown_have_the_outcome_on_the_page(command: list[str], tmp_path: Path) -> None:
    """Of their sweeps this one world."""
    _, show, directory, run = command
    suite, world, planner, _ = run.split("/")
    (headline,) = re.findall(rf"The first: (.*):\n\n```sh\n{' '.join(command)}\n", PAGE)
    sweep = f"sweep {suite} --planner {planner} --first {world} --worlds 1 --workers 1"
    step = "--set planner.step_length_m=0.08"  # which is predictive's own, as is the lidar all's
    shown_commands.mfba([*sweep.split(), *step.split(), "--out", directory], tmp_path)
    assert show == "show"
    found_cell = shown_commands.mfba(command[1:], tmp_path)
    assert found_cell.splitlines()[:2] == [run, headline]


def test_every_command_of_the_page_is_run_and_options_in_its_text_exist(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert {words[0] for words in SHOWN} == {"python", "mfba"}
    assert len(SHOWN) == 4
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    parser = runpy.run_path(str(SCRIPT))["arguments"]()
    for words in (WHOLE, MADE_BY):
        assert words[1] == "bench/benchmark.py"
        parser.parse_args(words[2:])
    for options_text in re.findall(r"`(--.*?)`", PAGE):
        options = [word for word in options_text.split() if word.startswith("--")]
        assert all(word == "--help" or f"{word} " in parser.format_help() for word in options)


def test_the_window_step_by_step_sees_what_ours_sees_between_its_steps() -> None:
    stepwise = runpy.run_path(str(ROOT / "bench" / "stepwise_dwa.py"))
    rng = np.random.default_rng(3)
    around = rng.uniform([-2.0, -2.0, -0.3, -0.3, 0.3], [2.0, 2.0, 0.3, 0.3, 0.6], size=(12, 5))
    samples = rng.uniform(-0.6, 0.6, size=(40, 2))
    exact = DynamicWindow.gaps(around, samples)
    missed = stepwise["StepwiseDwa"].gaps(around, samples) - exact
    # Within half a step no obstacle comes nearer than by its own path and the robot's.
    most = 0.5 * stepwise["STEP_S"] * (np.hypot(0.3, 0.3) + np.hypot(0.6, 0.6))
    assert missed.min() >= -1e-12
    assert 0.0 < missed.max() <= most
