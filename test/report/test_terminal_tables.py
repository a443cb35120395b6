# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables in a terminal: no number is broken, however narrow it is."""

import io

import pytest
from rich.console import Console

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.paper.tables.table_entries import Grid, Section
from mfba_planner.report.tables import terminal, text
from mfba_planner.report.tables.text import Origin

DIGITS = 5
GRID = Grid(
    key="k",
    title="A title",
    head=("reading", "law", "runs", *(f"mean length {n} m" for n in range(9)), "chance of this"),
    rows=tuple(
        (reading, law, 20, *(Interval(17.1 + n, 17.0 + n, 17.25 + n) for n in range(9)), 0.00888)
        for reading in ("section6", "fig1")
        for law in ("BA", "MFBA")
    ),
)


def shown(grid: Grid, width: int) -> str:
    """What is printed of a section that holds this grid only."""
    file = io.StringIO()
    section = Section(key="5", title="Table 5", grids=(grid,), digits=DIGITS)
    terminal.show(
        Console(file=file, width=width), [section], Origin(command="c", seed=0, quick=True)
    )
    return file.getvalue().partition("How many numbers")[0]


@pytest.mark.parametrize("width", [40, 60, 80, 100, 300])
def test_every_word_of_a_wide_table_is_whole(width: int) -> None:
    out = shown(GRID, width)
    assert max(map(len, out.splitlines())) <= width
    found = out.split()
    for cells in (GRID.head, *text.rows(GRID, DIGITS)):
        for word in " ".join(cells).split():
            assert word in found, word
    # Each table names its rows.
    tables = out.count("─\n") + out.count("─ \n")
    assert out.count("section6") == 2 * tables
    assert out.count("A title") == 1
    assert tables == 1 if width == 300 else tables > 1


@pytest.mark.parametrize("width", [40, 80])
def test_a_table_that_fits_is_one(width: int) -> None:
    grid = Grid(key="k", title="T", head=("reading", "law", "runs"), rows=(("fig1", "BA", 20),))
    out = shown(grid, width)
    assert [line.split() for line in out.splitlines() if "BA" in line] == [["fig1", "BA", "20"]]


def test_grids_without_rows_or_with_text_only() -> None:
    assert "reading" in shown(Grid(key="k", title="T", head=("reading", "law"), rows=()), 80)
    grid = Grid(key="k", title="T", head=("a", "b"), rows=(("one", "word " * 40),))
    assert shown(grid, 40).count("one") == 1
