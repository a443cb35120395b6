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
            console.print(_grid(grid, section.digits))
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


def _grid(grid: Grid, digits: int) -> Table:
    table = _new(grid.title)
    for head in grid.head:
        table.add_column(head, overflow="fold")
    for row in text.rows(grid, digits):
        table.add_row(*map(Text, row))
    return table


def _summary(sections: Sequence[Section]) -> Table:
    head, rows = markdown.summary(sections)
    table = _new("How many numbers got which verdict")
    for name, style in zip(head, ("", *STYLES.values())):
        table.add_column(name, style=style, justify="right" if name else "left")
    for row in rows:
        table.add_row(*row)
    return table
