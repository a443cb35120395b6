# SPDX-License-Identifier: Apache-2.0
"""Pictures of a comparison: mean ranks with critical difference, and loss over the budget."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from mfba_planner.evaluation.comparison.comparison_groups import Group

from .. import style
from ..figure_sheet import EDGE, Sheet

# inches
_WIDE, _TALL, _GAP, _HEAD, _SPACE, _ROW = 2.6, 1.7, 0.5, 1.0, 0.65, 0.22
_LABELS = 2.3
_COLUMNS = 3
_MOST_LINES = 8  # colours; more lines repeat them with other dashes
_COLOURS = (
    style.BLUE, style.VERMILLION, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, style.INK,
    style.FAINT,
)  # fmt: skip
_DASHES = ("-", (0, (4, 1.5)), (0, (1, 1.5)))
_MARKERS = "osD^v<>P"
_FLOOR = 1e-12  # smallest error drawn: 0 has no logarithm


def draw_ranks(groups: Sequence[Group]) -> Figure:
    """A panel per group: the mean rank of each optimiser, bars of half the critical difference.

    Optimisers whose bars do not overlap differ.
    """
    shown = [group for group in groups if group.ranks is not None]
    most = max((len(group.arms) for group in shown), default=1)
    names = list(dict.fromkeys(arm.optimizer for group in shown for arm in group.arms))
    tall = _ROW * most
    rows = -(-len(shown) // _COLUMNS)
    height = _HEAD + rows * (tall + 0.75) - 0.2
    sheet = Sheet(EDGE + _LABELS + _COLUMNS * _WIDE + (_COLUMNS - 1) * _GAP + EDGE, height)
    sheet.head(
        "Mean ranks of the optimisers",
        "suite, planner, evaluations; 1 is best; bars: half the critical difference (Nemenyi) "
        "to each side; where bars overlap, no difference is shown",
    )
    for number, group in enumerate(shown):
        row, column = divmod(number, _COLUMNS)
        left = EDGE + _LABELS + column * (_WIDE + _GAP)
        bottom = height - _HEAD - row * (tall + 0.75) - tall
        ax = sheet.axes(left, bottom, _WIDE, tall)
        _rank_panel(ax, group, names)
        ax.tick_params(length=0.0, labelleft=column == 0)
        parts = [group.suite, group.planner, str(group.budget)]
        sheet.text(left, bottom + tall + 0.1, ", ".join(filter(None, parts)))
    return sheet.figure


def _rank_panel(ax: Axes, group: Group, names: Sequence[str]) -> None:
    assert group.ranks is not None
    half = group.ranks.critical_difference / 2.0
    best = min(group.ranks.mean)
    for arm, mean in zip(group.arms, group.ranks.mean):
        near = mean - best < 2.0 * half
        colour = style.BLUE if near else style.QUIET
        y = names.index(arm.optimizer)
        ax.errorbar(mean, y, xerr=half, fmt="o", color=colour, markersize=4.5, capsize=2.0)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(0.5, len(group.arms) + 0.5)
    ax.set_xticks(range(1, len(group.arms) + 1))


def draw_budgets(groups: Sequence[Group]) -> Figure:
    """A panel per suite and planner (or function): the loss of each optimiser over the budget."""
    panels: dict[tuple[str, str], list[Group]] = {}
    for group in groups:
        if group.ranks is not None:
            panels.setdefault((group.suite, group.planner), []).append(group)
    names = list(dict.fromkeys(arm.optimizer for g in groups for arm in g.arms))
    rows = -(-len(panels) // _COLUMNS)
    keys = -(-len(names) // 4)
    height = _HEAD + rows * (_TALL + _SPACE) + 0.2 * keys + 0.1
    left = EDGE + 0.55
    sheet = Sheet(left + _COLUMNS * _WIDE + (_COLUMNS - 1) * _GAP * 1.6 + EDGE, height)
    sheet.head(
        "Loss over the budget",
        "worlds: mean of 1 - SPL in per cent, with its 95 % interval; functions: median error, "
        "log scale; over evaluations per decision or search",
    )
    for number, ((suite, planner), some) in enumerate(panels.items()):
        row, column = divmod(number, _COLUMNS)
        x = left + column * (_WIDE + 1.6 * _GAP)
        bottom = height - _HEAD - row * (_TALL + _SPACE) - _TALL
        ax = sheet.axes(x, bottom, _WIDE, _TALL)
        for name in names:
            _line(ax, some, name, names.index(name))
        ax.set_xscale("log")
        ax.set_xticks([g.budget for g in some], [str(g.budget) for g in some])
        ax.xaxis.set_minor_locator(NullLocator())
        if not planner:
            ax.set_yscale("log")
            ax.yaxis.set_major_locator(LogLocator(numticks=6))
            ax.yaxis.set_minor_locator(NullLocator())
            ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        ax.tick_params(length=0.0)
        sheet.text(x, bottom + _TALL + 0.1, suite + (f", {planner}" if planner else ""))
    entries = [(Line2D([], [], markersize=4.5, **_looks(k)), name) for k, name in enumerate(names)]
    sheet.legend(entries, left, 0.2 * keys + 0.15, ncols=4, columnspacing=2.0)
    return sheet.figure


def _line(ax: Axes, groups: Sequence[Group], name: str, number: int) -> None:
    found = [(g.budget, arm) for g in groups for arm in g.arms if arm.optimizer == name]
    if not found:
        return
    budgets = [budget for budget, _ in found]
    shifted = np.array(budgets) * (1.0 + 0.015 * (number - 3))  # so that equal bars stay visible
    looks = {"markersize": 4.5, **_looks(number)}
    if groups[0].is_function:
        medians = [arm.errors[1] if arm.errors else math.nan for _, arm in found]
        errors = [max(e, _FLOOR) if math.isfinite(e) else math.nan for e in medians]
        ax.plot(shifted, errors, **looks)
        return
    low, middle, high = np.array(
        [(100.0 * a.loss.low, 100.0 * a.loss.middle, 100.0 * a.loss.high) for _, a in found]
    ).T
    ax.errorbar(shifted, middle, yerr=[middle - low, high - middle], **looks)


def _looks(number: int) -> style.Looks:
    return {
        "color": _COLOURS[number % _MOST_LINES],
        "linestyle": _DASHES[number // _MOST_LINES % len(_DASHES)],
        "marker": _MARKERS[number % len(_MARKERS)],
        "linewidth": 1.2,
    }
