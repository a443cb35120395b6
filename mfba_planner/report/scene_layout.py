# SPDX-License-Identifier: Apache-2.0
"""The layout of a scene's picture: head, axes to scale, panel at the right, result strip."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator

from . import style
from .figure_sheet import EDGE, Sheet
from .format_values import one_line
from .legend import Entry
from .view_bounds import View

# inches
_GAP, _HEAD, _AXIS, _STRIP, _PANEL = 0.3, 0.85, 0.6, 0.8, 2.45
_ROW = 0.18


class SceneLayout:
    """A figure with one pair of axes; positions in inches from the lower left corner."""

    def __init__(self, view: View, scale: float) -> None:
        """Lay out the figure for a view at a scale in inches per metre."""
        width, height = view.width * scale, view.height * scale
        self._sheet = Sheet(width, height)
        self.figure = self._sheet.figure
        self.ax = self._sheet.axes(0.0, 0.0, width, height)
        self._set_limits(view)
        labels = self.ax.yaxis.get_tightbbox(self._sheet.renderer)
        self._left = left = EDGE + (-labels.x0 / style.DPI if labels else 0.0)
        bottom = _STRIP + _AXIS
        self._panel, self._floor, self._y = left + width + _GAP, bottom, bottom + height
        self._sheet.resize(self._panel + _PANEL + EDGE, bottom + height + _HEAD)
        self._sheet.move_axes(self.ax, left, bottom, width, height)

    def _set_limits(self, view: View) -> None:
        """Set the limits, and the same round grid spacing for both axes."""
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

    def head(self, title: str, subtitle: str) -> None:
        """Write title and subtitle above the axes."""
        self._sheet.head(title, subtitle, self._left)

    def legend(self, entries: Sequence[Entry]) -> None:
        """Put the legend at the top of the panel."""
        self._y = self._sheet.legend(entries, self._panel, self._y)

    def rows(self, title: str, rows: Sequence[tuple[str, str, str]]) -> None:
        """Write a small table into the panel; rows that do not fit are counted."""
        if not rows:
            return
        self._y -= 0.35
        self._sheet.text(self._panel, self._y, title, fontsize=style.SMALL, fontweight="bold")
        room = max(1, int((self._y - self._floor) / _ROW) - 1)
        shown = rows if len(rows) <= room else rows[: room - 1]
        for name, value, remark in shown:
            self._y -= _ROW
            self._sheet.text(self._panel, self._y, name, fontsize=style.SMALL)
            for x, text in ((1.55, value), (2.35, remark)):
                self._sheet.text(self._panel + x, self._y, text, fontsize=style.SMALL, ha="right")
        if len(shown) < len(rows):
            self.note(f"and {len(rows) - len(shown)} more")

    def note(self, text: str) -> None:
        """Write a grey line into the panel."""
        self._y -= _ROW
        self._sheet.text(
            self._panel, self._y, one_line(text, 40), fontsize=style.SMALL, color=style.QUIET
        )

    def strip(self, cells: Sequence[tuple[str, str, str]]) -> None:
        """Write (label, value, colour) cells along the lower edge, evenly apart."""
        rule = (_STRIP + 0.02) / self._sheet.height
        self.figure.add_artist(
            Line2D(
                [EDGE / self._sheet.width, 1.0 - EDGE / self._sheet.width],
                [rule, rule],
                color=style.FAINT,
                linewidth=0.8,
            )
        )
        pairs = [
            (
                self._sheet.text(0.0, 0.52, label, fontsize=style.SMALL, color=style.QUIET),
                self._sheet.text(
                    0.0, 0.27, value, fontsize=style.NORMAL + 1, fontweight="bold", color=colour
                ),
            )
            for label, value, colour in cells
        ]
        widths = [max(self._sheet.size(text) for text in pair) for pair in pairs]
        gap = (self._sheet.width - 2.0 * EDGE - sum(widths)) / max(1, len(cells) - 1)
        x = EDGE
        for pair, width in zip(pairs, widths):
            for text in pair:
                text.set_x(x / self._sheet.width)
            x += width + gap
