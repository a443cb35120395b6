# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables as Markdown, and generated blocks inside a page written by hand."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from mfba_planner.core.errors import InputError
from mfba_planner.paper.tables.model import Grid, Section, Verdict

from . import text
from .text import Origin


def page(sections: Sequence[Section], origin: Origin) -> str:
    """All sections as one page."""
    parts = ["# The paper's tables again", origin.line(), _table(*summary(sections))]
    parts += [f"## {section.title}\n\n{body(section)}" for section in sections]
    return "\n\n".join(parts) + "\n"


def blocks(sections: Sequence[Section], origin: Origin) -> dict[str, str]:
    """{name: Markdown} of what a page may hold between markers."""
    content = [origin.line(), _table(*summary(sections)), *map(body, sections)]
    return dict(zip(block_names([section.key for section in sections]), content))


def block_names(keys: Iterable[str]) -> list[str]:
    """Names of the blocks that the sections of these keys fill."""
    return ["origin", "summary", *(f"section {key}" for key in keys)]


def fill(page_text: str, generated: Mapping[str, str]) -> str:
    """The page with its generated blocks made anew; InputError when one has no place in it."""
    for name, content in generated.items():
        begin, end = f"<!-- begin generated: {name} -->", f"<!-- end generated: {name} -->"
        pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
        if not pattern.search(page_text):
            raise InputError(f"no place for {name!r}: put the lines {begin} and {end} there")
        whole = f"{begin}\n{content}\n{end}".replace("\\", r"\\")
        page_text = pattern.sub(whole, page_text)
    return page_text


def summary(sections: Sequence[Section]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and rows: how many numbers of each section got which verdict."""
    head = ("", *(verdict.value for verdict in Verdict))
    rows = [
        (title, *(str(found[verdict] or "") for verdict in Verdict))
        for title, found in text.counts(sections)
    ]
    return head, rows


def body(section: Section) -> str:
    """A section without its title."""
    parts = []
    if section.entries:
        names = text.readings(section)
        shown = [
            (
                text.label(e),
                e.printed,
                *(text.ours(e, name, section.digits) for name in names),
                e.verdict.value,
                e.why,
            )
            for e in section.entries
        ]
        parts.append(_table(("number", "printed", *names, "verdict", "why"), shown))
    if told := text.seeds(section):
        parts.append(told)
    parts += [_grid(grid, section.digits) for grid in section.grids]
    if section.notes:
        parts.append("\n".join(f"- {note}" for note in section.notes))
    return "\n\n".join(parts)


def _grid(grid: Grid, digits: int) -> str:
    parts = [f"**{grid.title}**", _table(grid.head, text.rows(grid, digits))]
    return "\n\n".join([*parts, grid.note] if grid.note else parts)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(_escape, cells))} |" for cells in lines)


def _escape(value: str) -> str:
    return value.replace("|", "\\|").replace("*", "\\*")
