# SPDX-License-Identifier: Apache-2.0
"""The sheet a scene is printed on: head, axes to scale, a panel at the right, a result strip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator, MultipleLocator

from . import style
from .legend import Entry
from .view import View
from .words import one_line

# inches
_EDGE, _GAP, _HEAD, _AXIS, _STRIP, _PANEL = 0.3, 0.3, 0.85, 0.6, 0.8, 2.45
_ROW = 0.18


class Page:
    """A figure with one pair of axes; measures are in inches from the lower left corner."""

    def __init__(self, view: View, scale: float) -> None:
        """Lay the sheet out for a view at a scale in inches per metre."""
        width, height = view.width * scale, view.height * scale
        self.figure = Figure(figsize=(width, height))
        self._canvas = FigureCanvasAgg(self.figure)
        self.ax = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self._rule_axes(view)
        labels = self.ax.yaxis.get_tightbbox(self._canvas.get_renderer())
        left = _EDGE + (-labels.x0 / style.DPI if labels else 0.0)
        bottom = _STRIP + _AXIS
        self._panel, self._floor, self._y = left + width + _GAP, bottom, bottom + height
        self._width, self._height = self._panel + _PANEL + _EDGE, bottom + height + _HEAD
        self.figure.set_size_inches(self._width, self._height)
        corner = (left / self._width, bottom / self._height)
        self.ax.set_position((*corner, width / self._width, height / self._height))
        self._left = left

    def _rule_axes(self, view: View) -> None:
        """Limits, and the same round step of the grid along both axes."""
        ax = self.ax
        ax.set_xlim(view.left, view.right)
        ax.set_ylim(view.bottom, view.top)
        ax.set_aspect("equal")
        values = MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(0.0, max(view.width, view.height))
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_locator(MultipleLocator(float(values[1] - values[0])))
        ax.set_xlabel("x (m)")
        ax.set_ylabel("y (m)")
        ax.tick_params(length=0.0, pad=5.0)

    def _text(self, x: float, y: float, text: str, **looks: Any) -> Text:
        return self.figure.text(x / self._width, y / self._height, drawable(text), **looks)

    def _size(self, text: Text) -> float:
        """Width of a text in inches."""
        return text.get_window_extent(self._canvas.get_renderer()).width / style.DPI

    def head(self, title: str, subtitle: str) -> None:
        """Write the title and, below it, a subtitle; each is cut where the sheet ends."""
        room = self._width - self._left - _EDGE
        top = self._height - 0.3
        for text, y, looks in (
            (title, top, {"fontsize": style.LARGE, "fontweight": "bold"}),
            (subtitle, top - 0.25, {"fontsize": style.NORMAL, "color": style.QUIET}),
        ):
            words = one_line(text, 200)
            label = self._text(self._left, y, words, va="center", **looks)
            while self._size(label) > room:
                words = one_line(words, len(words) - 4)
                label.set_text(drawable(words))

    def legend(self, entries: Sequence[Entry]) -> None:
        """Put the legend at the top of the panel."""
        legend = self.figure.legend(
            [handle for handle, _ in entries],
            [label for _, label in entries],
            loc="upper left",
            bbox_to_anchor=(self._panel / self._width, self._y / self._height),
            borderaxespad=0.0,
            borderpad=0.0,
            handlelength=2.2,
            labelspacing=0.65,
        )
        self._y = legend.get_window_extent(self._canvas.get_renderer()).y0 / style.DPI

    def rows(self, title: str, rows: Sequence[tuple[str, str, str]]) -> None:
        """Write a small table into the panel; what does not fit is counted."""
        if not rows:
            return
        self._y -= 0.35
        self._text(self._panel, self._y, title, fontsize=style.SMALL, fontweight="bold")
        room = max(1, int((self._y - self._floor) / _ROW) - 1)
        shown = rows if len(rows) <= room else rows[: room - 1]
        for name, value, remark in shown:
            self._y -= _ROW
            self._text(self._panel, self._y, name, fontsize=style.SMALL)
            for x, text in ((1.55, value), (2.35, remark)):
                self._text(self._panel + x, self._y, text, fontsize=style.SMALL, ha="right")
        if len(shown) < len(rows):
            self.note(f"and {len(rows) - len(shown)} more")

    def note(self, text: str) -> None:
        """Write a quiet line into the panel."""
        self._y -= _ROW
        self._text(
            self._panel, self._y, one_line(text, 40), fontsize=style.SMALL, color=style.QUIET
        )

    def strip(self, cells: Sequence[tuple[str, str, str]]) -> None:
        """Write (label, value, colour) cells along the lower edge, evenly apart."""
        rule = (_STRIP + 0.02) / self._height
        self.figure.add_artist(
            Line2D(
                [_EDGE / self._width, 1.0 - _EDGE / self._width],
                [rule, rule],
                color=style.FAINT,
                linewidth=0.8,
            )
        )
        pairs = [
            (
                self._text(0.0, 0.52, label, fontsize=style.SMALL, color=style.QUIET),
                self._text(
                    0.0, 0.27, value, fontsize=style.NORMAL + 1, fontweight="bold", color=colour
                ),
            )
            for label, value, colour in cells
        ]
        widths = [max(self._size(text) for text in pair) for pair in pairs]
        gap = (self._width - 2.0 * _EDGE - sum(widths)) / max(1, len(cells) - 1)
        x = _EDGE
        for pair, width in zip(pairs, widths):
            for text in pair:
                text.set_x(x / self._width)
            x += width + gap


def drawable(text: str) -> str:
    """Text with a question mark for each letter that the house font does not have."""
    known = get_font(findfont("DejaVu Sans")).get_charmap()
    return "".join(letter if ord(letter) in known else "?" for letter in text)
