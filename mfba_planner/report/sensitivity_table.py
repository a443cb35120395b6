# SPDX-License-Identifier: Apache-2.0
"""The sensitivity study as a table: for terminals, as CSV and as Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from itertools import groupby

from rich.table import Table

from mfba_planner.paper.sensitivity import CASES, ENCOUNTERS, LAWS, STATISTICS, Row

_ROOM_FOR_INTERVALS = 115  # columns
ROW_MARK, ENCOUNTERS_MARK = "●", "◆"
FIGURES = {"case1": "Fig. 7", "case2": "Fig. 8"}  # columns: share of runs with its encounters
LEGEND = (
    f"{ROW_MARK} the printed row lies within ours (95 % of ten runs: best, mean and worst, no "
    f"contact); {ENCOUNTERS_MARK} most runs meet the obstacles of the figure ("
    + "; ".join(f"case {case[-1]}: {expected}" for case, expected in ENCOUNTERS.items())
    + "); with few seeds the marks are uncertain"
)


def pairs(rows: Sequence[Row]) -> Iterator[tuple[Row, ...]]:
    """Yield the rows of each reading together, one row per case."""
    for _, group in groupby(rows, key=lambda row: row.reading.name):
        yield tuple(group)


def to_csv(rows: Sequence[Row]) -> str:
    """All numbers as CSV: one line per reading and case, lengths in metres."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    spans = [f"{name}_{end}_m" for name in STATISTICS for end in ("median", "low", "high")]
    holds = [f"holds_{law}_{name}" for law in LAWS for name in STATISTICS]
    head = ["group", "reading", "case", *spans, *holds]
    writer.writerow([*head, "printed_rows", "contacts", "reached", "encounters_as_figure"])
    for row in rows:
        writer.writerow(
            [
                row.reading.group,
                row.reading.label,
                row.case,
                *(f"{v:.5f}" for i in row.intervals for v in (i.middle, i.low, i.high)),
                *(int(inside) for law in LAWS for inside in row.holds(law)),
                " ".join(row.reproduces),
                *(f"{share:.4f}" for share in (row.contacts, row.reached, row.as_figure)),
            ]
        )
    return sink.getvalue()


def to_table(rows: Sequence[Row], title: str, width: int = 120) -> Table:
    """One line per reading, both cases side by side; narrow tables lack groups and intervals."""
    narrow = width < _ROOM_FOR_INTERVALS
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.caption, table.caption_justify = LEGEND, "left"
    if not narrow:
        table.add_column("", style="dim", no_wrap=True)
    table.add_column("reading", no_wrap=True)
    for case in CASES:
        table.add_column(f"case {case[-1]}" + ("" if narrow else ": mean (m)"), no_wrap=True)
        table.add_column("row", no_wrap=True)
        table.add_column(FIGURES[case], justify="right", no_wrap=True)
    table.add_column("hit" if narrow else "contact", justify="right", no_wrap=True)
    for cells in _lines(rows):
        table.add_row(*(_narrow(cells) if narrow else cells))
    return table


def to_markdown(rows: Sequence[Row]) -> str:
    """The same lines as a Markdown table."""
    head = ["", "reading"]
    for case in CASES:
        head += [f"case {case[-1]}: mean (m)", "row", FIGURES[case]]
    head.append("contact")
    lines = [head, ["---"] * len(head), *_lines(rows)]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def _lines(rows: Sequence[Row]) -> Iterator[list[str]]:
    """Group, reading, per case (mean with interval, printed rows, runs as in Fig.), contacts."""
    previous = ""
    for group in pairs(rows):
        reading = group[0].reading
        cells = [reading.group if reading.group != previous else "", reading.label]
        previous = reading.group
        for row in group:
            mean = row.intervals[STATISTICS.index("mean")]
            marks = " ".join(f"{ROW_MARK} {law}" for law in row.reproduces)
            as_figure = f"{row.as_figure:.0%}{ENCOUNTERS_MARK if row.mostly_as_figure else ' '}"
            cells += [f"{mean.middle:.3f} [{mean.low:.3f}, {mean.high:.3f}]", marks, as_figure]
        yield [*cells, f"{max(row.contacts for row in group):.0%}"]


def _narrow(cells: Sequence[str]) -> list[str]:
    """A line without its group and intervals."""
    return [cell.partition(" [")[0].replace(f"{ROW_MARK} ", ROW_MARK) for cell in cells[1:]]
