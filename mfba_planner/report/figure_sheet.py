# SPDX-License-Identifier: Apache-2.0
"""A figure laid out in inches from its lower left corner: head, texts, axes, legend, bytes."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.text import Text

from . import style
from .format_values import one_line
from .legend import Entry

EDGE = 0.3
# No date and no version: the same figure gives the same bytes.
_PLAIN: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None, "Format": None, "Type": None},
}


class Sheet:
    """A figure with positions in inches; use and save it within style.context()."""

    def __init__(self, width: float, height: float) -> None:
        """Make an empty figure; call resize() only before texts and legends are added."""
        self.width, self.height = width, height
        self.figure = Figure(figsize=(width, height))
        self._canvas = FigureCanvasAgg(self.figure)

    def resize(self, width: float, height: float) -> None:
        """Change width and height (inches)."""
        self.width, self.height = width, height
        self.figure.set_size_inches(width, height)

    @property
    def renderer(self) -> RendererAgg:
        """The renderer that measures texts."""
        return self._canvas.get_renderer()

    def axes(self, left: float, bottom: float, width: float, height: float) -> Axes:
        """Add axes whose frame has this corner and size (inches)."""
        return self.figure.add_axes(self._fractions(left, bottom, width, height))

    def move_axes(self, ax: Axes, left: float, bottom: float, width: float, height: float) -> None:
        """Move axes to this corner and size (inches)."""
        ax.set_position(self._fractions(left, bottom, width, height))

    def _fractions(self, *box: float) -> tuple[float, float, float, float]:
        """Left, bottom, width and height as fractions of the figure."""
        left, bottom, width, height = box
        return left / self.width, bottom / self.height, width / self.width, height / self.height

    def text(self, x: float, y: float, text: str, **looks: Any) -> Text:
        """Write a text; characters that the font lacks become question marks."""
        return self.figure.text(x / self.width, y / self.height, drawable(text), **looks)

    def size(self, text: Text) -> float:
        """Width of a text (inches)."""
        return text.get_window_extent(self.renderer).width / style.DPI

    def head(self, title: str, subtitle: str, left: float = EDGE) -> None:
        """Write the title and, below it, a subtitle; each is cut at the figure's edge."""
        room = self.width - left - EDGE
        top = self.height - 0.3
        for text, y, looks in (
            (title, top, {"fontsize": style.LARGE, "fontweight": "bold"}),
            (subtitle, top - 0.25, {"fontsize": style.NORMAL, "color": style.QUIET}),
        ):
            words = one_line(text, 200)
            label = self.text(left, y, words, va="center", **looks)
            while self.size(label) > room:
                words = one_line(words, len(words) - 4)
                label.set_text(drawable(words))

    def legend(self, entries: Sequence[Entry], x: float, top: float, **looks: Any) -> float:
        """Put a legend with its upper left corner at (x, top); return its lower edge (inches)."""
        legend = self.figure.legend(
            [handle for handle, _ in entries],
            [label for _, label in entries],
            loc="upper left",
            bbox_to_anchor=(x / self.width, top / self.height),
            **{"borderaxespad": 0.0, "borderpad": 0.0, "handlelength": 2.2, "labelspacing": 0.65,
               **looks},
        )  # fmt: skip
        return float(legend.get_window_extent(self.renderer).y0 / style.DPI)


def to_bytes(figure: Figure, form: str) -> bytes:
    """The figure as png or svg, without date or version inside."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form, metadata=_PLAIN[form])
    return buffer.getvalue()


def drawable(text: str) -> str:
    """Text with a question mark for each character that the figures' font lacks."""
    known = get_font(findfont("DejaVu Sans")).get_charmap()
    return "".join(c if c == "\n" or ord(c) in known else "?" for c in text)
