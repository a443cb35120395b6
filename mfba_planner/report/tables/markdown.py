# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables as Markdown, and as generated blocks inside a hand-written page."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from mfba_planner.core.errors import InputError
from mfba_planner.paper.tables.table_entries import Grid, Section, Verdict

from . import text
from .text import Origin


def page(sections: Sequence[Section], origin: Origin) -> str:
    """All sections as one page."""
    blocks = ["# The paper's tables again", origin.line(), _table(*summary(sections))]
    blocks += [f"## {section.title}\n\n{body(section)}" for section in sections]
    return "\n\n".join(blocks) + "\n"


def blocks(sections: Sequence[Section], origin: Origin) -> dict[str, str]:
    """{name: Markdown} of the blocks that a page may hold between markers."""
    content = [origin.line(), _table(*summary(sections)), *map(body, sections)]
    return dict(zip(block_names([section.key for section in sections]), content))


def block_names(keys: Iterable[str]) -> list[str]:
    """Names of the blocks of the sections with these keys."""
    return ["origin", "summary", *(f"section {key}" for key in keys)]


def fill(page_text: str, generated: Mapping[str, str]) -> str:
    """The page with its generated blocks replaced; InputError when its markers are missing."""
    for name, content in generated.items():
        start, end = f"<!-- begin generated: {name} -->", f"<!-- end generated: {name} -->"
        pattern = re.compile(re.escape(start) + ".*?" + re.escape(end), re.DOTALL)
        if not pattern.search(page_text):
            raise InputError(f"no block {name!r}; add the lines {start} and {end}")
        whole = f"{start}\n{content}\n{end}".replace("\\", r"\\")
        page_text = pattern.sub(whole, page_text)
    return page_text


def summary(sections: Sequence[Section]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and rows: the number of each verdict in each section."""
    head = ("", *(verdict.value for verdict in Verdict))
    rows = [
        (title, *(str(found[verdict] or "") for verdict in Verdict))
        for title, found in text.counts(sections)
    ]
    return head, rows


def body(section: Section) -> str:
    """A section without its title."""
    blocks = []
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
        blocks.append(_table(("number", "printed", *names, "verdict", "why"), shown))
    if seeds := text.seeds(section):
        blocks.append(seeds)
    blocks += [_grid(grid, section.digits) for grid in section.grids]
    if section.notes:
        blocks.append("\n".join(f"- {note}" for note in section.notes))
    return "\n\n".join(blocks)


def _grid(grid: Grid, digits: int) -> str:
    blocks = [f"**{grid.title}**", _table(grid.head, text.rows(grid, digits))]
    return "\n\n".join([*blocks, grid.note] if grid.note else blocks)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(_escape, cells))} |" for cells in lines)


def _escape(value: str) -> str:
    return value.replace("|", "\\|").replace("*", "\\*")
