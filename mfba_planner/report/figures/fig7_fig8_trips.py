# SPDX-License-Identifier: Apache-2.0
"""Fig. 7 and 8: snapshots of a run - free, obstacles sensed, path generation again, goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mfba_planner.core.errors import InputError
from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.metrics import Result, evaluate, within_range
from mfba_planner.simulation.episode import Episode

from .. import format_values, legend, style
from ..draw_tick import draw_snapshot
from ..figure_sheet import EDGE, Sheet
from ..run_events import closest_passes
from ..view_bounds import View, choose_view

# inches
_SIDE, _GAP, _TITLE, _HEAD, _AXIS = 3.3, 0.45, 0.42, 0.7, 0.45
_LEGEND = 2.5
_ROW = _TITLE + _SIDE + 0.55


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A tick of a run (index from 0) and its caption."""

    index: int
    caption: str


def snapshots(episode: Episode) -> list[Snapshot]:
    """The snapshots that the paper shows of a run.

    A tick before the first avoidance; each tick of the first avoidance with more obstacles within
    SR than before; the first tick of path generation after it; the last tick. Raises InputError
    for a run without obstacle avoidance.
    """
    modes = [tick.mode for tick in episode.ticks]
    if Mode.OBSTACLE_AVOIDANCE not in modes:
        raise InputError(
            f"{format_values.run_title(episode)}: avoids no obstacle; give a run that does"
        )
    first = modes.index(Mode.OBSTACLE_AVOIDANCE)
    length = sum(1 for _ in takewhile(lambda m: m is Mode.OBSTACLE_AVOIDANCE, modes[first:]))
    found = [Snapshot(first // 2, "nothing within SR")]
    most = 0
    for index in range(first, first + length):
        near = within_range(episode, episode.ticks[index])
        if len(near) > most:
            most = len(near)
            found.append(Snapshot(index, f"{_obstacles(near)} within SR"))
    after = first + length
    if after < len(modes) - 1:
        found.append(Snapshot(after, "back to path generation"))
    return [*found, Snapshot(len(modes) - 1, format_values.outcome(evaluate(episode)))]


def _obstacles(numbers: Sequence[int]) -> str:
    plural = "s" if len(numbers) > 1 else ""
    return f"obstacle{plural} {' and '.join(map(str, numbers))}"


def draw(episode: Episode, title: str, note: str = "") -> Figure:
    """Draw the snapshots side by side, then legend and result."""
    shown = snapshots(episode)
    columns = 2 if len(shown) < 5 else 3
    rows = -(-len(shown) // columns)
    height = _HEAD + rows * _ROW + EDGE / 2
    corners = [
        (EDGE + _AXIS + column * (_SIDE + _GAP), height - _HEAD - _TITLE - row * _ROW)
        for row in range(rows)
        for column in range(columns)
    ]
    width = corners[-1][0] + _SIDE + EDGE
    if len(shown) == len(corners):  # the legend needs a column of its own
        corners.append((width, corners[0][1]))
        width += _LEGEND + EDGE
    sheet = Sheet(width, height)
    sheet.head(title, "; ".join(filter(None, [_subtitle(episode), note])))
    view = _view(episode)
    axes = []
    for label, snapshot, (left, top) in zip("abcdefgh", shown, corners):
        ax = sheet.axes(left, top - _SIDE, _SIDE, _SIDE)
        axes.append(ax)
        draw_snapshot(ax, episode, snapshot.index)
        _set_limits(ax, view, first=left == corners[0][0])
        _caption(sheet, left, top + 0.12, label, snapshot, episode)
    left, top = corners[len(shown)]
    below = sheet.legend(legend.entries(*axes), left, top, labelspacing=0.9)
    _facts(sheet, left, below, evaluate(episode))
    return sheet.figure


def _subtitle(episode: Episode) -> str:
    law = episode.planner.bat.algorithm.value.upper()
    return f"{episode.scenario.description}; {law}, seed {episode.seed}"


def _view(episode: Episode) -> View:
    """A square that holds the run, and the sensing range at the last tick."""
    view, _ = choose_view(episode, closest_passes(episode))
    view = view.around(episode.ticks[-1].pose.position, 1.1 * episode.sensor.sensing_range_m)
    side = max(view.width, view.height)
    return view.grown((side - view.width) / 2.0, (side - view.height) / 2.0)


def _set_limits(ax: Axes, view: View, first: bool) -> None:
    ax.set_xlim(view.left, view.right)
    ax.set_ylim(view.bottom, view.top)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 3, 5, 10]))
    ax.tick_params(length=0.0, pad=4.0)
    ax.set_xlabel("x (m)", labelpad=1.0)
    if first:
        ax.set_ylabel("y (m)", labelpad=1.0)


def _caption(
    sheet: Sheet, left: float, y: float, label: str, snapshot: Snapshot, episode: Episode
) -> None:
    time_s = episode.time_s(episode.ticks[snapshot.index].stamp_ns)
    sheet.text(left, y, f"({label})", fontweight="bold")
    sheet.text(left + 0.3, y, snapshot.caption)
    right = left + _SIDE
    sheet.text(right, y, format_values.number(time_s, 1, "s"), ha="right", color=style.QUIET)


def _facts(sheet: Sheet, left: float, top: float, result: Result) -> None:
    rows = (
        ("length", format_values.length(result)),
        ("time", format_values.time(result)),
        ("min clearance", format_values.clearance(result)),
        ("collisions", str(result.collisions)),
    )
    for row, (name, value) in enumerate(rows):
        y = top - 0.4 - 0.2 * row
        sheet.text(left, y, name, fontsize=style.SMALL, color=style.QUIET)
        sheet.text(left + 1.9, y, value, fontsize=style.SMALL, ha="right", fontweight="bold")
