# SPDX-License-Identifier: Apache-2.0
"""Cells, entries and headings of reproduced tables as text, shared by all output forms."""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mfba_planner import __version__
from mfba_planner.evaluation.statistics import Interval
from mfba_planner.paper.tables.table_entries import Cell, Entry, Grid, Section, Verdict

NOTHING = "–"


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """The origin of the numbers: command, seed and versions; command makes them again."""

    command: str
    seed: int
    quick: bool
    version: str = __version__
    python: str = platform.python_version()
    numpy: str = np.__version__

    def line(self) -> str:
        """One sentence for the head of a report."""
        size = "quick form: only the full form's verdicts count; " if self.quick else ""
        return (
            f"Made by `{self.command}` ({size}seeds from {self.seed} on) with mfba_planner "
            f"{self.version}, Python {self.python}, numpy {self.numpy}."
        )


def cell(value: Cell, digits: int) -> str:
    """A cell with this number of significant digits; an interval as middle [low, high]."""
    if value is None:
        return ""
    if isinstance(value, Interval):
        low, high = _number(value.low, digits), _number(value.high, digits)
        return f"{_number(value.middle, digits)} [{low}, {high}]"
    if isinstance(value, float):
        return f"{value + 0.0:.{digits}g}"
    return str(value)


def _number(value: float, digits: int) -> str:
    """Format a bound of an interval: trailing zeros are kept, zero has no minus."""
    return f"{value:#.{digits}g}".rstrip(".") if value else "0"


def rows(grid: Grid, digits: int) -> Iterator[list[str]]:
    """The rows of a grid; `digits` holds for columns that are not in grid.digits."""
    shown = [grid.digits.get(name, digits) for name in grid.head]
    for row in grid.rows:
        yield [cell(value, count) for value, count in zip(row, shown)]


def readings(section: Section) -> tuple[str, ...]:
    """Names of the readings in a section's entries, sorted by first appearance."""
    return tuple(dict.fromkeys(o.reading for e in section.entries for o in e.ours))


def label(entry: Entry) -> str:
    """Name of an entry within its section: its row, and its column where that is needed."""
    return entry.row if entry.column in ("claim", "value") else f"{entry.row}, {entry.column}"


def ours(entry: Entry, reading: str, digits: int) -> str:
    """The value of a reading for an entry."""
    found = [cell(o.value, digits) for o in entry.ours if o.reading == reading]
    return found[0] if found else NOTHING


def seeds(section: Section) -> str:
    """The seeds of the entries, "" if there are none."""
    found = dict.fromkeys(
        f"{o.reading} {o.seeds}" for e in section.entries for o in e.ours if o.seeds
    )
    return f"Seeds: {', '.join(found)}." if found else ""


def counts(sections: Sequence[Section]) -> list[tuple[str, dict[Verdict, int]]]:
    """(title, {verdict: number of entries}) of each section."""
    return [
        (
            section.title.split(".")[0],
            {verdict: Counter(e.verdict for e in section.entries)[verdict] for verdict in Verdict},
        )
        for section in sections
    ]
