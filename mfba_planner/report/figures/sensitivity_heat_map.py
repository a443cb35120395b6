# SPDX-License-Identifier: Apache-2.0
"""The sensitivity study as a heat-map: our lengths minus the printed ones, for each reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from mfba_planner.paper.sensitivity import CASES, LAWS, STATISTICS, Row

from .. import style
from ..figure_sheet import EDGE, Sheet
from ..sensitivity_table import pairs

# inches
_WIDE, _TALL, _GAP, _LABELS, _HEAD, _FOOT = 0.45, 0.24, 0.18, 3.35, 1.5, 0.75
_FULL_CM = 60.0  # deviation with the darkest colour
_OFF = LinearSegmentedColormap.from_list("off", [style.BLUE, style.PAPER, style.VERMILLION])
_ENCOUNTERS = LinearSegmentedColormap.from_list("encounters", [style.PAPER, style.GREEN])
_CONTACTS = LinearSegmentedColormap.from_list("contacts", [style.PAPER, style.PURPLE])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Block:
    """Columns under one title: values and frames (lines, columns), shades from 0 to 1."""

    title: str
    columns: tuple[str, ...]
    values: np.ndarray
    framed: np.ndarray
    shades: np.ndarray
    colours: Colormap
    signed: bool = False


def draw(rows: Sequence[Row]) -> Figure:
    """Draw one line per reading: deviations (cm), encounters and contacts (per cent)."""
    lines = list(pairs(rows))
    blocks = _blocks(lines)
    width = sum(_WIDE * len(block.columns) + _GAP for block in blocks)
    top = _FOOT + len(lines) * _TALL
    sheet = Sheet(EDGE + _LABELS + width + EDGE - _GAP, top + _HEAD)
    sheet.head(
        "What the paper does not state",
        "median of ten runs minus printed length, in cm; each line differs from the first in "
        "what it names",
    )
    _labels(sheet, lines, top)
    x = EDGE + _LABELS
    for block in blocks:
        wide = _WIDE * len(block.columns)
        _cells(sheet.axes(x, _FOOT, wide, top - _FOOT), block, _breaks(lines))
        middle = x + wide / 2.0
        sheet.text(middle, top + 0.3, block.title, ha="center", **_TITLE)
        for k, name in enumerate(block.columns):
            sheet.text(x + (k + 0.5) * _WIDE, top + 0.08, name, ha="center", **_COLUMN)
        x += wide + _GAP
    sheet.legend(_entries(), EDGE, _FOOT - 0.25, ncols=4, columnspacing=2.0)
    return sheet.figure


_TITLE: style.Looks = {"fontsize": style.SMALL, "fontweight": "bold", "va": "bottom"}
_COLUMN: style.Looks = {"fontsize": style.SMALL - 1.0, "color": style.QUIET, "va": "bottom"}


def _blocks(lines: Sequence[tuple[Row, ...]]) -> list[_Block]:
    found = []
    for law in LAWS:
        for k, case in enumerate(CASES):
            off = 100.0 * np.array([group[k].off_m(law) for group in lines])
            found.append(
                _Block(
                    title=f"{law}\ncase {case[-1]}",
                    columns=STATISTICS,
                    values=off,
                    framed=np.array([group[k].holds(law) for group in lines]),
                    shades=0.5 + 0.5 * np.sign(off) * np.minimum(1.0, abs(off) / _FULL_CM) ** 0.6,
                    colours=_OFF,
                    signed=True,
                )
            )
    names = tuple(f"case {case[-1]}" for case in CASES)
    as_figure = np.array([[row.as_figure for row in group] for group in lines])
    contacts = np.array([[row.contacts for row in group] for group in lines])
    mostly_as_figure = np.array([[row.mostly_as_figure for row in group] for group in lines])
    for title, share, framed, colours in (
        ("meets as in\nFig. 7, 8 (%)", as_figure, mostly_as_figure, _ENCOUNTERS),
        ("in contact\n(%)", contacts, np.zeros_like(mostly_as_figure), _CONTACTS),
    ):
        found.append(
            _Block(
                title=title,
                columns=names,
                values=100.0 * share,
                framed=framed,
                shades=0.75 * share,
                colours=colours,
            )
        )
    return found


def _cells(ax: Axes, block: _Block, breaks: Sequence[int]) -> None:
    lines, columns = block.values.shape
    ax.set_xlim(0, columns)
    ax.set_ylim(lines, 0)
    ax.set_axis_off()
    for i in range(lines):
        for j in range(columns):
            shade = block.colours(float(block.shades[i, j]))
            ax.add_patch(Rectangle((j, i), 1, 1, facecolor=shade, **_CELL))
            text = f"{block.values[i, j]:+.0f}" if block.signed else f"{block.values[i, j]:.0f}"
            # white on dark colours
            ink = style.PAPER if sum(shade[:3]) < 1.35 else style.INK
            ax.text(j + 0.5, i + 0.53, "0" if text in ("+0", "-0") else text, color=ink, **_NUMBER)
    for i, j in zip(*np.nonzero(block.framed)):
        ax.add_patch(Rectangle((j + 0.05, i + 0.09), 0.9, 0.82, **_FRAME))
    for i in breaks:
        ax.plot([0, columns], [i, i], **_BREAK)


_CELL: style.Looks = {"edgecolor": style.PAPER, "linewidth": 0.8}
_NUMBER: style.Looks = {"ha": "center", "va": "center", "fontsize": style.SMALL - 1.0}
_FRAME: style.Looks = {"fill": False, "edgecolor": style.INK, "linewidth": 1.3, "zorder": 3.0}
_BREAK: style.Looks = {"color": style.QUIET, "linewidth": 0.8, "zorder": 4.0}
_ROW_MARK: style.Looks = {
    "linestyle": "none", "marker": "o", "markersize": 6.0, "markeredgewidth": 0.0,
}  # fmt: skip
_LAW_COLOURS = dict(zip(LAWS, (style.BLUE, style.VERMILLION)))


def _breaks(lines: Sequence[tuple[Row, ...]]) -> list[int]:
    """Lines at which another group starts."""
    groups = [group[0].reading.group for group in lines]
    return [i for i in range(1, len(groups)) if groups[i] != groups[i - 1]]


def _labels(sheet: Sheet, lines: Sequence[tuple[Row, ...]], top: float) -> None:
    """Group, reading, and a mark for each printed row that it reproduces in both cases."""
    ax = sheet.axes(EDGE, _FOOT, _LABELS - 0.1, top - _FOOT)
    ax.set_xlim(0, _LABELS - 0.1)
    ax.set_ylim(len(lines), 0)
    ax.set_axis_off()
    starts = [0, *_breaks(lines)]
    for i, group in enumerate(lines):
        reading = group[0].reading
        if i in starts:
            ax.text(0, i + 0.53, reading.group, va="center", fontsize=style.SMALL,
                    fontweight="bold")  # fmt: skip
        ax.text(0.95, i + 0.53, reading.label, va="center", fontsize=style.SMALL)
        for k, law in enumerate(LAWS):
            if all(law in row.reproduces for row in group):
                looks = {**_ROW_MARK, "color": _LAW_COLOURS[law]}
                ax.plot([_LABELS - 0.2 - 0.14 * k], [i + 0.5], **looks)
    for i in starts[1:]:
        ax.plot([0, _LABELS - 0.1], [i, i], **_BREAK)


def _entries() -> list[tuple[Line2D | Patch, str]]:
    marks: list[tuple[Line2D | Patch, str]] = [
        (
            Line2D([], [], **_ROW_MARK, color=colour),
            f"{law}'s printed rows of both cases lie within",
        )
        for law, colour in _LAW_COLOURS.items()
    ]
    frame = Patch(facecolor="none", edgecolor=style.INK, linewidth=1.3)
    return [
        (frame, "printed value within our 95 % of ten runs; most runs meet as in Fig. 7, 8"),
        *marks,
    ]
