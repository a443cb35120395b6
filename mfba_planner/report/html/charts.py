# SPDX-License-Identifier: Apache-2.0
"""Charts of clearance and speed over time: SVG by matplotlib, one for each page width.

Colours are variables of the page's style sheet, so one drawing serves the light and the dark
theme. Text stays text, in the page's font. The script adds a cursor from the times and positions
given with each drawing. No text of a run is in a drawing.
"""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Sequence
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mfba_planner.core.planner_types import Mode
from mfba_planner.report import style
from mfba_planner.report.run_events import stretches
from mfba_planner.simulation.episode import Episode

from .page_data import MOST_RUNS, clearances, speeds

# (smallest page width in CSS pixels, width and height in points)
SHEETS = ((0, 290.0, 300.0), (500, 470.0, 300.0), (900, 860.0, 280.0))
_LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 34.0, 10.0, 20.0, 24.0, 34.0  # points
# Dashes of the runs' lines in line widths, for readers who cannot tell colours apart.
DASHES: tuple[tuple[float, ...], ...] = ((), (5, 2), (1.5, 1.5), (7, 2, 1.5, 2), (10, 3), (3, 3))
_SHARE = 0.6  # of the height, for clearance
_POINTS_PER_INCH = 72.0

# Placeholder colours, used for nothing else; the page's style sheet has the real ones.
_VARIABLES = [
    "ink", "quiet", "faint", "grid", "bad",
    *(f"run-{number}" for number in range(1, MOST_RUNS + 1)),
    *(f"mode-{mode.value}" for mode in Mode),
]  # fmt: skip
_PLACEHOLDERS = {name: f"#fe{number:02x}a7" for number, name in enumerate(_VARIABLES)}


def look(number: int) -> tuple[int, tuple[float, ...]]:
    """Colour (1 to MOST_RUNS) and dashes of run `number` (from 0), different for each run."""
    turn, colour = divmod(number, MOST_RUNS)
    return colour + 1, DASHES[(colour + turn) % len(DASHES)]


def charts(episodes: Sequence[Episode]) -> list[dict[str, Any]]:
    """The drawings, narrowest first: SVG text, time range, and its position (of the width)."""
    return [_chart(episodes, *sheet) for sheet in SHEETS]


def _chart(
    episodes: Sequence[Episode], from_px: int, width: float, height: float
) -> dict[str, Any]:
    start = min(_times(episode)[0] for episode in episodes)
    end = max(max(_times(episode)[-1] for episode in episodes), start + 1e-3)
    with style.context(), rc_context({"svg.fonttype": "none", "font.size": style.NORMAL}):
        figure = Figure(figsize=(width / _POINTS_PER_INCH, height / _POINTS_PER_INCH))
        figure.patch.set_visible(False)
        room = height - _TOP - _BOTTOM - _GAP
        low = (1.0 - _SHARE) * room
        gaps = [clearances(episode) for episode in episodes]
        # Nobody knows the obstacles of a real robot: what it perceives is not the truth.
        known = any(map(math.isfinite, itertools.chain(*gaps)))
        title = "Clearance, edge to edge (m)" if known else "Clearance: no obstacle is known"
        upper = _axes(figure, title, _BOTTOM + low + _GAP, _SHARE * room)
        lower = _axes(figure, "Speed (m/s)", _BOTTOM, low)
        upper.tick_params(labelbottom=False)
        upper.axhline(0.0, color=_PLACEHOLDERS["bad"], linewidth=0.9, linestyle=(0, (2, 2)))
        for number, episode in enumerate(episodes):
            colour, dashes = look(number)
            looks: style.Looks = {
                "color": _PLACEHOLDERS[f"run-{colour}"],
                "linestyle": (0, dashes),
                "gid": f"line-{number + 1}",
            }
            if len(episodes) == 1:
                looks["color"] = _PLACEHOLDERS["ink"]  # the bands are coloured
            _step_plot(upper, episode, gaps[number], looks)
            _step_plot(lower, episode, speeds(episode), looks)
        for ax in (upper, lower):
            ax.set_xlim(start, end)
            ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
            if len(episodes) == 1:
                _bands(ax, episodes[0])
        if not known:
            upper.set_ylim(0.0, 1.0)
            upper.set_yticks([])
        lower.xaxis.set_major_formatter("{x:g} s")
        return {
            "from_px": from_px,
            "svg": _svg(figure),
            "left": _LEFT / width,
            "right": 1.0 - _RIGHT / width,
            "start": start,
            "end": end,
        }


def _axes(figure: Figure, title: str, bottom: float, height: float) -> Axes:
    """Axes across the figure; bottom and height in points."""
    width_in, height_in = figure.get_size_inches()
    whole_w, whole_h = width_in * _POINTS_PER_INCH, height_in * _POINTS_PER_INCH
    across = 1.0 - (_LEFT + _RIGHT) / whole_w
    ax = figure.add_axes((_LEFT / whole_w, bottom / whole_h, across, height / whole_h))
    ax.set_title(title, loc="left", fontsize=style.NORMAL, color=_PLACEHOLDERS["ink"], pad=6.0)
    ax.patch.set_visible(False)
    ax.grid(True, color=_PLACEHOLDERS["grid"])
    for name, spine in ax.spines.items():
        spine.set_visible(name == "bottom")
        spine.set_color(_PLACEHOLDERS["faint"])
    ax.tick_params(length=0.0, pad=4.0, labelsize=style.NORMAL, labelcolor=_PLACEHOLDERS["quiet"])
    ax.locator_params(axis="y", nbins=5)
    ax.locator_params(axis="x", nbins=max(4, int(whole_w / 70.0)))
    return ax


def _times(episode: Episode) -> list[float]:
    return [episode.time_s(tick.stamp_ns) for tick in episode.ticks]


def _step_plot(ax: Axes, episode: Episode, values: Sequence[float], looks: style.Looks) -> None:
    """Plot a value that holds from each tick to the next."""
    finite = [value if math.isfinite(value) else math.nan for value in values]
    ax.plot(_times(episode), finite, drawstyle="steps-post", linewidth=1.5, **looks)


def _bands(ax: Axes, episode: Episode) -> None:
    """Shade the times of all modes but path generation."""
    times, first = _times(episode), 0
    for stretch in stretches(episode):
        end = first + len(stretch.ticks)
        if stretch.mode is not Mode.PATH_GENERATION:
            until = times[min(end, len(times) - 1)]
            colour = _PLACEHOLDERS[f"mode-{stretch.mode.value}"]
            ax.axvspan(times[first], until, color=colour, alpha=0.16, linewidth=0.0, zorder=0.0)
        first = end


def _svg(figure: Figure) -> str:
    """The drawing as SVG text, with the page's colours, without date and version."""
    sink = io.StringIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    figure.savefig(sink, format="svg", metadata=nothing)
    text = sink.getvalue()
    for name, placeholder in _PLACEHOLDERS.items():
        text = text.replace(placeholder, f"var(--{name})")
    return text[text.index("<svg") :]
