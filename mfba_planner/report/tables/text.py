# SPDX-License-Identifier: Apache-2.0
"""Cells, entries and headings as text: the same words in every form."""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mfba_planner import __version__
from mfba_planner.evaluation.statistics import Interval
from mfba_planner.paper.tables.model import Cell, Entry, Grid, Section, Verdict

NOTHING = "–"


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """What the numbers come from; command is what makes them again."""

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
    """A cell with so many significant digits; an interval as middle [low, high]."""
    if value is None:
        return ""
    if isinstance(value, Interval):
        low, high = _number(value.low, digits), _number(value.high, digits)
        return f"{_number(value.middle, digits)} [{low}, {high}]"
    if isinstance(value, float):
        return f"{value + 0.0:.{digits}g}"
    return str(value)


def _number(value: float, digits: int) -> str:
    """Trailing zeros are kept where an interval has them; no minus before zero."""
    return f"{value:#.{digits}g}".rstrip(".") if value else "0"


def rows(grid: Grid, digits: int) -> Iterator[list[str]]:
    """The rows of a grid; columns without digits of their own have those of the section."""
    shown = [grid.digits.get(name, digits) for name in grid.head]
    for row in grid.rows:
        yield [cell(value, count) for value, count in zip(row, shown)]


def readings(section: Section) -> tuple[str, ...]:
    """Names of the readings that a section's entries show, in order of first appearance."""
    return tuple(dict.fromkeys(o.reading for e in section.entries for o in e.ours))


def label(entry: Entry) -> str:
    """What an entry is, within its section; some columns go without saying."""
    return entry.row if entry.column in ("claim", "value") else f"{entry.row}, {entry.column}"


def ours(entry: Entry, reading: str, digits: int) -> str:
    """What a reading gives for an entry."""
    found = [cell(o.value, digits) for o in entry.ours if o.reading == reading]
    return found[0] if found else NOTHING


def seeds(section: Section) -> str:
    """Which seeds the entries come from, "" where there are none."""
    told = dict.fromkeys(
        f"{o.reading} {o.seeds}" for e in section.entries for o in e.ours if o.seeds
    )
    return f"Seeds: {', '.join(told)}." if told else ""


def counts(sections: Sequence[Section]) -> list[tuple[str, dict[Verdict, int]]]:
    """(title, {verdict: how many}) of each section."""
    return [
        (
            section.title.split(".")[0],
            {verdict: Counter(e.verdict for e in section.entries)[verdict] for verdict in Verdict},
        )
        for section in sections
    ]
