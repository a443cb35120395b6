# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables in the terminal: rich tables that fit its width."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from mfba_planner.paper.tables.table_entries import Entry, Grid, Section, Verdict

from ..terminal_output import print_encodable
from . import markdown, text
from .text import Origin

_PADDING = 3  # of a column: one space on either side and the line
STYLES = {
    Verdict.REPRODUCED: "green",
    Verdict.DIFFERS: "red",
    Verdict.IMPOSSIBLE: "magenta",
    Verdict.NOT_STATED: "yellow",
}


def show(console: Console, sections: Sequence[Section], origin: Origin) -> None:
    """Print all sections, then the summary."""
    print_encodable(console, lambda encodable: _print(encodable, sections, origin))


def _print(console: Console, sections: Sequence[Section], origin: Origin) -> None:
    for section in sections:
        console.print()
        console.print(Text(section.title, style="bold underline"))
        if section.entries:
            console.print(_numbers(section))
        for grid in section.grids:
            for table in _grid(grid, section.digits, console.width):
                console.print(table)
            if grid.note:
                console.print(Padding(Text(grid.note, style="dim"), (0, 1)))
        for note in (*filter(None, [text.seeds(section)]), *section.notes):
            console.print(Padding(Text(f"• {note}"), (0, 1)))
    console.print()
    console.print(_summary(sections))
    console.print(Text(origin.line(), style="dim"))


def _new(title: str = "") -> Table:
    heading = Text(title, style="italic") if title else None
    return Table(title=heading, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)


def _numbers(section: Section) -> Table:
    table = _new()
    names = text.readings(section)
    for head in ("number", "printed", "ours", "verdict", "why"):
        table.add_column(head, overflow="fold")
    for e in section.entries:
        table.add_row(
            Text(text.label(e)),
            Text(e.printed),
            Text(_ours(e, names, section.digits)),
            Text(e.verdict.value, style=STYLES[e.verdict]),
            Text(e.why, style="dim"),
        )
    return table


def _ours(e: Entry, names: Sequence[str], digits: int) -> str:
    shown = [(name, text.ours(e, name, digits)) for name in names if len(e.ours)]
    if len(names) == 1:
        return "\n".join(value for _, value in shown)
    return "\n".join(f"{name}: {value}" for name, value in shown)


def _grid(grid: Grid, digits: int, width: int) -> list[Table]:
    """The tables of a grid, more than one where its columns do not fit without broken words."""
    rows = list(text.rows(grid, digits))
    least = [
        max(len(word) for cell in column for word in cell.split() or [""])
        for column in zip(grid.head, *rows)
    ]
    tables: list[Table] = []
    for columns in _column_blocks(least, _label_count(grid), width):
        table = _new("" if tables else grid.title)
        for column in columns:
            table.add_column(grid.head[column], overflow="fold", min_width=least[column])
        for row in rows:
            table.add_row(*(Text(row[column]) for column in columns))
        tables.append(table)
    return tables


def _label_count(grid: Grid) -> int:
    """How many columns name the rows: the first ones that hold text only, one at least."""
    columns = list(zip(*grid.rows))
    numbers = (
        k for k, column in enumerate(columns) if not all(isinstance(v, str) for v in column)
    )
    return max(1, next(numbers, 1))


def _column_blocks(least: Sequence[int], labels: int, width: int) -> list[list[int]]:
    """The numbers of the columns of each table; each begins with the columns of the labels.

    least: the width of the longest word of each column. A column that does not fit at all has a
    table of its own.
    """
    names = list(range(labels))
    blocks = [list(names)]
    for column in range(labels, len(least)):
        block = [*blocks[-1], column]
        if sum(least[k] + _PADDING for k in block) > width and len(blocks[-1]) > labels:
            blocks.append([*names, column])
        else:
            blocks[-1] = block
    return blocks


def _summary(sections: Sequence[Section]) -> Table:
    head, rows = markdown.summary(sections)
    table = _new("How many numbers got which verdict")
    for name, style in zip(head, ("", *STYLES.values())):
        table.add_column(name, style=style, justify="right" if name else "left")
    for row in rows:
        table.add_row(*row)
    return table
