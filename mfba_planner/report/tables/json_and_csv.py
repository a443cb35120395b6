# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables as data: JSON of everything, CSV with one line per number and reading."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.paper.tables.table_entries import Cell, Section

from .text import Origin

SCHEMA_VERSION = 1
CSV_HEAD = (
    "place", "row", "column", "printed", "reading", "ours", "low", "high", "seeds", "verdict",
    "why",
)  # fmt: skip


def to_json(sections: Sequence[Section], origin: Origin) -> str:
    """Everything as JSON; an interval is a mapping of middle, low and high."""
    data = {
        "schema_version": SCHEMA_VERSION,
        "origin": asdict(origin),
        "sections": [_section(section) for section in sections],
    }
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _section(section: Section) -> dict[str, Any]:
    return {
        "key": section.key,
        "title": section.title,
        "numbers": [
            {
                "place": e.place,
                "row": e.row,
                "column": e.column,
                "printed": e.printed,
                "ours": {o.reading: {"value": _plain(o.value), "seeds": o.seeds} for o in e.ours},
                "verdict": e.verdict.value,
                "why": e.why,
            }
            for e in section.entries
        ],
        "grids": {
            grid.key: {
                "title": grid.title,
                "head": list(grid.head),
                "rows": [[_plain(value) for value in row] for row in grid.rows],
                "note": grid.note,
            }
            for grid in section.grids
        },
        "notes": list(section.notes),
    }


def _plain(value: Cell) -> Any:
    if isinstance(value, Interval):
        return {name: _plain(item) for name, item in asdict(value).items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def to_csv(sections: Sequence[Section]) -> str:
    """One line per printed number and reading, numbers with all digits."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    writer.writerow(CSV_HEAD)
    for section in sections:
        for e in section.entries:
            head, tail = (e.place, e.row, e.column, e.printed), (e.verdict.value, e.why)
            for o in e.ours:
                writer.writerow((*head, o.reading, *_three(o.value), o.seeds, *tail))
            if not e.ours:
                writer.writerow((*head, "", "", "", "", "", *tail))
    return sink.getvalue()


def _three(value: Cell) -> tuple[Any, Any, Any]:
    if isinstance(value, Interval):
        return value.middle, value.low, value.high
    return value, "", ""
