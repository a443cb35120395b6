# SPDX-License-Identifier: Apache-2.0
"""The data model of a reproduced table: sections, entries, grids and verdicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from ...evaluation.statistics import Interval
from .. import impossible_numbers
from ..published import Printed

Cell = str | int | float | Interval | None


class Verdict(Enum):
    """The verdict on a printed number."""

    REPRODUCED = "reproduced"
    DIFFERS = "differs"
    IMPOSSIBLE = "impossible as printed"
    NOT_STATED = "not stated in the paper"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ours:
    """The value of one of our readings for a printed number; seeds: those of its runs."""

    reading: str
    value: Cell
    seeds: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A printed number (or a value that the paper lacks), our values, verdict and reason."""

    place: str
    row: str
    column: str
    printed: str
    ours: tuple[Ours, ...]
    verdict: Verdict
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """A table of our own; key: its name in the data; digits: {column: significant digits}."""

    key: str
    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    digits: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A reproduced table of the paper; digits: number of significant digits shown."""

    key: str
    title: str
    entries: tuple[Entry, ...] = ()
    grids: tuple[Grid, ...] = ()
    notes: tuple[str, ...] = ()
    digits: int = 5


def entry(printed: Printed, ours: Sequence[Ours], verdict: Verdict, why: str) -> Entry:
    """An Entry of a printed number; a contradiction to another printed number is added to why."""
    contradiction = impossible_numbers.CONTRADICTED.get(printed.key, "")
    return Entry(
        place=printed.place,
        row=printed.row,
        column=printed.column,
        printed=printed.text,
        ours=tuple(ours),
        verdict=verdict,
        why="; ".join(reason for reason in (why, contradiction) if reason),
    )


def compare_exactly(printed: Printed, reading: str, ours: Cell, why: str = "") -> Entry:
    """Reproduced when ours is the printed value itself."""
    same = ours == (printed.text if printed.value is None else printed.value)
    verdict = Verdict.REPRODUCED if same else Verdict.DIFFERS
    return entry(printed, [Ours(reading=reading, value=ours)], verdict, why)


def inside(printed: Printed, ours: Sequence[Ours], meant: str) -> Entry:
    """Reproduced when the printed value lies in the 95 % interval of the reading `meant`.

    Other readings are listed in the reason only.
    """
    value = math.nan if printed.value is None else printed.value
    fits = [o.reading for o in ours if isinstance(o.value, Interval) and value in o.value]
    fails = [o.reading for o in ours if o.reading not in fits]
    positions = []
    if fits:
        positions.append(f"in the 95 % interval of {' and '.join(fits)}")
    if fails:
        positions.append(f"outside that of {' and '.join(fails)}")
    why = ", ".join(positions)
    if printed.key in impossible_numbers.IMPOSSIBLE:
        return entry(
            printed,
            ours,
            Verdict.IMPOSSIBLE,
            f"{impossible_numbers.IMPOSSIBLE[printed.key]} ({why})",
        )
    return entry(printed, ours, Verdict.REPRODUCED if meant in fits else Verdict.DIFFERS, why)
