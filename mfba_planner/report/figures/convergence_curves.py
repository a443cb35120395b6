# SPDX-License-Identifier: Apache-2.0
"""Convergence of BA and MFBA on F1-F6: distance to the minimum over the iterations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator

from mfba_planner.paper.benchmark_functions import FUNCTIONS
from mfba_planner.paper.convergence_curves import READING, RUNS, Curve, curves
from mfba_planner.paper.study.plan import SWARM_READINGS
from mfba_planner.swarm.bat_swarm import Algorithm

from .. import style
from ..figure_sheet import EDGE, Sheet

LAWS: dict[Algorithm, style.Looks] = {
    Algorithm.BA: {"color": style.VERMILLION, "linestyle": (0, (4, 1.5))},
    Algorithm.MFBA: {"color": style.BLUE, "linestyle": "-"},
}
_WIDTH, _HEIGHT, _GAP, _ROW = 2.75, 2.0, 0.65, 2.85  # inches
_COLUMNS = 3
_FLOOR = 1e-16  # smallest distance drawn: 0 has no logarithm


def draw() -> Figure:
    """Draw a panel per function."""
    bat = SWARM_READINGS[READING]
    rows = -(-len(FUNCTIONS) // _COLUMNS)
    left = EDGE + 0.55
    height = 0.75 + rows * _ROW + 0.45
    sheet = Sheet(left + _COLUMNS * _WIDTH + (_COLUMNS - 1) * _GAP + EDGE, height)
    sheet.head(
        "Convergence on F1 to F6",
        f"best value so far minus minimum, {RUNS} runs each, reading {READING}, "
        f"{bat.population} bats, T = {bat.iterations}, d = 2",
    )
    for index, (key, function) in enumerate(FUNCTIONS.items()):
        row, column = divmod(index, _COLUMNS)
        x, top = left + column * (_WIDTH + _GAP), height - 1.15 - row * _ROW
        ax = sheet.axes(x, top - _HEIGHT, _WIDTH, _HEIGHT)
        _panel(ax, curves(key))
        ax.set_xlabel("iteration" if row == rows - 1 else "")
        ax.set_ylabel("distance to minimum" if column == 0 else "")
        sheet.text(x, top + 0.1, key, fontweight="bold")
        sheet.text(x + 0.3, top + 0.1, function.title)
    sheet.legend(_entries(), left, 0.42, ncols=3, columnspacing=2.5)
    return sheet.figure


def _panel(ax: Axes, found: Sequence[Curve]) -> None:
    for curve in found:
        low, middle, high = np.maximum(curve.error, _FLOOR)
        t = np.arange(middle.size)
        looks = LAWS[curve.algorithm]
        ax.fill_between(t, low, high, color=looks["color"], alpha=0.16, linewidth=0.0)
        ax.plot(t, middle, linewidth=style.MODE_WIDTH, **looks)
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(numticks=6))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.set_xlim(0, t[-1])
    ax.xaxis.set_major_locator(MultipleLocator(50))
    ax.tick_params(length=0.0)


def _entries() -> list[tuple[Line2D | Patch, str]]:
    lines: list[tuple[Line2D | Patch, str]] = [
        (Line2D([], [], linewidth=style.MODE_WIDTH, **looks), f"{law.value.upper()}, median")
        for law, looks in LAWS.items()
    ]
    band = Patch(facecolor=style.QUIET, alpha=0.3, linewidth=0.0)
    return [*lines, (band, "10 % to 90 % of the runs")]
