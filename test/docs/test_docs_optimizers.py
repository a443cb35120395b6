# SPDX-License-Identifier: Apache-2.0
"""docs/optimizers.md: its commands run, its results are those of the command it shows."""

import csv
import re
import shlex
import shutil
from pathlib import Path

import pytest
import shown_commands
from project import ROOT

from mfba_planner.cli import compare

SOURCE = ROOT / "docs/optimizers.md"
PAGE = SOURCE.read_text(encoding="utf-8")
QUICK, ROOMS, RESULTS = shown_commands.commands(PAGE)
BEGIN, END = (f"<!-- {word} generated: comparison -->" for word in ("begin", "end"))
BLOCK = PAGE[PAGE.index(BEGIN) : PAGE.index(END)]


def rows(directory: Path) -> list[dict[str, str]]:
    with open(directory / "table.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_block_is_of_the_command_that_is_shown() -> None:
    parsed = compare._parser().parse(RESULTS[2:])
    assert f"\n- `{compare.command_line(parsed)}`\n" in BLOCK
    assert shlex.split(compare.command_line(parsed))[2] == "paper"
    spec, functions = parsed.optimizers, parsed.where
    assert BLOCK.count("evaluations**: ") == 3 * 2 * len(parsed.budgets)
    assert len(spec) == 7
    assert len(functions) == 9
    for name in ("ranks", "budgets"):
        assert f"(images/optimizers-{name}.png)" in BLOCK
        assert (ROOT / f"docs/images/optimizers-{name}.png").is_file()


def test_sentences_and_tables_agree() -> None:
    """The number of comparisons, and how they turned out."""
    found = re.search(r"in (\d+) combinations .* (\d+) comparisons: (.*)\. A diff", BLOCK)
    assert found
    combinations, comparisons, counts = found.groups()
    table = BLOCK[BLOCK.index("| in suites |") : BLOCK.index("| in functions |")]
    cells = [re.findall(r"\| (\d+)", line) for line in table.splitlines()[2:] if line]
    totals = [sum(int(line[k]) for line in cells) for k in range(4)]
    assert counts == ", ".join(
        f"{which} {n}" for which, n in zip(("better", "worse", "equal", "open"), totals)
    )
    assert int(combinations) * (7 - 1) == int(comparisons) == sum(totals)


def test_the_quick_form_runs_and_a_row_is_run_again_as_described(tmp_path: Path) -> None:
    shown_commands.mfba(shown_commands.reduced(QUICK)[1:], tmp_path)
    wanted = {"suite": "random-10", "world": "3", "optimizer": "random", "budget": "25"}
    shown_commands.mfba(shown_commands.reduced(ROOMS)[1:], tmp_path)
    assert [r["success"] for r in rows(tmp_path / "runs/rooms")] == ["true"] * 2
    (row,) = [r for r in rows(tmp_path / "runs/quick") if wanted.items() <= r.items()]
    iterations = 25 // 5 - 1
    shown_commands.mfba(
        shlex.split(
            f"sweep random-10 --planner paper --optimizer random --set planner.bat.iterations="
            f"{iterations} --first 3 --worlds 1 --workers 1 --out again"
        ),
        tmp_path,
    )
    (again,) = rows(tmp_path / "again")
    assert {name: row[name] for name in again} == again


@pytest.mark.parametrize("words", [RESULTS])
def test_the_command_of_the_results_fills_the_page(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    shutil.copy(SOURCE, tmp_path / "docs")
    reduced = shown_commands.reduced(words)
    assert reduced[-2:] == words[-2:] == ["--update", "docs/optimizers.md"]
    shown_commands.mfba(reduced[1:], tmp_path)
    page = (tmp_path / "docs/optimizers.md").read_text(encoding="utf-8")
    assert page.partition(BEGIN)[0] == PAGE.partition(BEGIN)[0]
    assert "**suite paper, planner paper, 25 evaluations**: 2 worlds" in page
