# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables as one HTML page with style and figures inside."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from mfba_planner.paper.tables.table_entries import Entry, Grid, Section, Verdict
from mfba_planner.report import style

from . import markdown, text
from .text import Origin

# Each verdict has a sign too, for readers who cannot tell the colours apart.
SIGNS = {
    Verdict.REPRODUCED: ("✓", style.GREEN),
    Verdict.DIFFERS: ("≠", style.VERMILLION),
    Verdict.IMPOSSIBLE: ("✗", style.PURPLE),
    Verdict.NOT_STATED: ("?", style.QUIET),
}
_CSS = f"""
body {{ font: 15px/1.5 system-ui, sans-serif; color: {style.INK}; background: {style.PAPER};
  max-width: 76rem; margin: 2rem auto; padding: 0 1rem; }}
h1 {{ font-size: 1.7rem; }} h2 {{ margin-top: 2.6rem; border-bottom: 2px solid {style.BLUE}; }}
h3 {{ font-size: 1rem; margin: 1.6rem 0 .3rem; }}
nav a {{ margin-right: 1rem; white-space: nowrap; }} a {{ color: {style.BLUE}; }}
.scroll {{ overflow-x: auto; }}
table {{ border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }}
th, td {{ text-align: left; vertical-align: top; padding: .22rem .7rem .22rem 0;
  border-bottom: 1px solid {style.GRID}; }}
th {{ color: {style.QUIET}; font-weight: 600; border-bottom-color: {style.FAINT}; }}
td.why, p.note, footer {{ color: {style.QUIET}; }}
.verdict {{ white-space: nowrap; font-weight: 600; }}
figure {{ margin: 1rem 0; }} figure img {{ max-width: 100%; }}
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure for the page: a title and the text of an SVG file."""

    title: str
    svg: str


def page(sections: Sequence[Section], origin: Origin, pictures: Sequence[Picture] = ()) -> str:
    """The whole page; the same sections and pictures give the same bytes."""
    links = [f'<a href="#s-{escape(s.key)}">{escape(s.title.split(".")[0])}</a>' for s in sections]
    links += ['<a href="#figures">Figures</a>'] if pictures else []
    head, rows = markdown.summary(sections)
    blocks = [
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>The paper's tables again</title><style>{_CSS}</style></head><body>",
        "<h1>The paper's tables again</h1>",
        f'<p class="note">{escape(origin.line())}</p><nav>{"".join(links)}</nav>',
        _table(head, (map(escape, row) for row in rows)),
        *map(_section, sections),
        _figures(pictures),
        "</body></html>",
    ]
    return "\n".join(block for block in blocks if block) + "\n"


def _section(section: Section) -> str:
    blocks = [f'<h2 id="s-{escape(section.key)}">{escape(section.title)}</h2>']
    if section.entries:
        names = text.readings(section)
        head = ("number", "printed", *names, "verdict", "why")
        blocks.append(_table(head, (_entry(e, names, section.digits) for e in section.entries)))
    if seeds := text.seeds(section):
        blocks.append(f'<p class="note">{escape(seeds)}</p>')
    blocks += [_grid(grid, section.digits) for grid in section.grids]
    if section.notes:
        blocks.append(f"<ul>{''.join(f'<li>{escape(note)}</li>' for note in section.notes)}</ul>")
    return "\n".join(blocks)


def _entry(e: Entry, names: Sequence[str], digits: int) -> Iterable[str]:
    yield escape(text.label(e))
    yield f"<b>{escape(e.printed)}</b>"
    for name in names:
        yield escape(text.ours(e, name, digits))
    sign, colour = SIGNS[e.verdict]
    yield f'<span class="verdict" style="color:{colour}">{sign} {escape(e.verdict.value)}</span>'
    yield escape(e.why)


def _grid(grid: Grid, digits: int) -> str:
    rows = (map(escape, row) for row in text.rows(grid, digits))
    note = f'<p class="note">{escape(grid.note)}</p>' if grid.note else ""
    return f"<h3>{escape(grid.title)}</h3>{_table(grid.head, rows)}{note}"


def _table(head: Sequence[str], rows: Iterable[Iterable[str]]) -> str:
    """A table of escaped cells."""
    heads = "".join(f"<th>{escape(name)}</th>" for name in head)
    lines = "\n".join(f"<tr>{''.join(f'<td>{c}</td>' for c in row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{heads}</tr>\n{lines}</table></div>'


def _figures(pictures: Sequence[Picture]) -> str:
    if not pictures:
        return ""
    # As images: ids of different SVGs must not clash.
    shown = (
        f"<figure><figcaption><h3>{escape(p.title)}</h3></figcaption><img "
        f'alt="{escape(p.title)}" src="data:image/svg+xml;base64,'
        f'{base64.b64encode(p.svg.encode()).decode()}"></figure>'
        for p in pictures
    )
    return '<h2 id="figures">Figures</h2>' + "\n".join(shown)
