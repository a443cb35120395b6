# SPDX-License-Identifier: Apache-2.0
"""Fig. 2: beta of eq. 10 over the iterations for several rho, as printed and normalised."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mfba_planner.swarm.bat_swarm import BatParams, BatSwarm, Box, Schedule

from .. import style
from ..figure_sheet import EDGE, Sheet

RHOS = (0.01, 0.5, 1.0, 3.0)
HORIZON = 50
_DASHES: tuple[style.Looks, ...] = (
    {"color": style.BLUE, "linestyle": "-"},
    {"color": style.GREEN, "linestyle": (0, (6, 1.5))},
    {"color": style.ORANGE, "linestyle": (0, (3, 1.5))},
    {"color": style.VERMILLION, "linestyle": (0, (1, 1.2))},
)
_BATS = 4
_DOTS: style.Looks = {"linestyle": "none", "marker": "o", "markersize": 2.4, "alpha": 0.6,
                      "markeredgewidth": 0.0}  # fmt: skip
_ALLOWED: style.Looks = {"color": style.INK, "linewidth": 1.1, "linestyle": (0, (1, 1.8))}
_WIDTH, _HEIGHT, _GAP = 3.7, 3.0, 1.05  # inches


def betas(rho: float, schedule: Schedule, draws: np.ndarray) -> np.ndarray:
    """Beta for the uniform draws of iterations 0 to HORIZON, (bats, HORIZON + 1) both."""
    params = BatParams(rho=rho, schedule=schedule, iterations=HORIZON)
    swarm = BatSwarm(params, Box((0.0,), (1.0,)), np.random.default_rng(0))
    found = np.empty(draws.shape)
    for t in range(HORIZON + 1):
        swarm.t = t
        found[:, t] = [swarm.beta(draw) for draw in draws[:, t]]
    return found


def draw() -> Figure:
    """Draw both readings of eq. 10 side by side."""
    left, bottom = EDGE + 0.45, EDGE + 0.85
    sheet = Sheet(left + 2 * _WIDTH + 2 * _GAP, bottom + _HEIGHT + 1.15)
    sheet.head(
        "Fig. 2: the frequency law of MFBA",
        "eq. 10 replaces BA's random β by an increasing function of the iteration t",
    )
    panels = (
        (Schedule.RAW, "as printed: β = t · exp(-ρ r)"),
        (Schedule.NORMALIZED, f"normalised: β = (t / T) · exp(-ρ r), T = {HORIZON}"),
    )
    for column, (schedule, caption) in enumerate(panels):
        x = left + column * (_WIDTH + _GAP)
        ax = sheet.axes(x, bottom, _WIDTH, _HEIGHT)
        _panel(ax, schedule)
        sheet.text(x, bottom + _HEIGHT + 0.1, f"({'ab'[column]})", fontweight="bold")
        sheet.text(x + 0.28, bottom + _HEIGHT + 0.1, caption)
    handles = [
        (Line2D([], [], color=style.QUIET, linewidth=style.MODE_WIDTH), "r = 0.5"),
        (Line2D([], [], color=style.QUIET, **_DOTS), f"{_BATS} bats, each with a random r"),
        (Line2D([], [], **_ALLOWED), "β = 1, the most that eq. 4 allows"),
    ]
    sheet.legend(handles, left, bottom - 0.6, ncols=3, columnspacing=2.5)
    return sheet.figure


def _panel(ax: Axes, schedule: Schedule) -> None:
    t = np.arange(HORIZON + 1)
    draws = np.random.default_rng(0).random((_BATS, HORIZON + 1))
    for rho, looks in zip(RHOS, _DASHES):
        (middle,) = betas(rho, schedule, np.full((1, HORIZON + 1), 0.5))
        ax.plot(t, middle, linewidth=style.MODE_WIDTH, zorder=3.0, **looks)
        for bat in betas(rho, schedule, draws):
            ax.plot(t, bat, color=looks["color"], **_DOTS)
        ax.annotate(
            f"ρ = {rho:g}", (HORIZON, middle[-1]), (6, 0), textcoords="offset points",
            va="center", color=style.INK, fontsize=style.SMALL,
        )  # fmt: skip
    ax.axhline(1.0, zorder=2.5, **_ALLOWED)
    ax.set_xlim(0, HORIZON)
    ax.set_ylim(0, 52 if schedule is Schedule.RAW else 1.04)
    ax.set_xlabel("iteration t")
    ax.set_ylabel("β")
    ax.tick_params(length=0.0)
