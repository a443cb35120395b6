# SPDX-License-Identifier: Apache-2.0
"""Colours, line styles and fonts of all pictures.

The palette is Okabe and Ito's (2008), for colour-blind readers. Marks that must not be confused
differ in width, dashes or shape too.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from mfba_planner.core.planner_types import Mode

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
INK = "#222222"
QUIET = "#666666"
FAINT = "#B8B8B8"
GRID = "#EDEDED"
PAPER = "#FFFFFF"
GOOD, BAD = GREEN, VERMILLION

MODE_COLOURS = {
    Mode.IDLE: FAINT,
    Mode.PATH_GENERATION: BLUE,
    Mode.OBSTACLE_AVOIDANCE: VERMILLION,
    Mode.BLOCKED: PURPLE,
    Mode.STOPPED: BLACK,
    Mode.ARRIVED: GREEN,
}
MODE_WIDTH = 2.0
MODE_WIDTHS = {Mode.OBSTACLE_AVOIDANCE: 3.4}

SMALL, NORMAL, LARGE = 8.0, 9.0, 13.0  # font sizes in points
DPI = 150

Looks = dict[str, Any]
OBSTACLE: Looks = {"facecolor": "#CFCFCF", "edgecolor": QUIET, "linewidth": 0.9}
ENLARGED: Looks = {"edgecolor": QUIET, "linewidth": 0.9, "linestyle": (0, (1, 1.8))}
TRACK: Looks = {"color": QUIET, "linewidth": 0.9, "linestyle": (0, (5, 3))}
ARROW: Looks = {
    "arrowstyle": "-|>", "mutation_scale": 9.0, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 0.0,
    "color": QUIET,
}  # fmt: skip
RECORDED: Looks = {"color": INK, "linewidth": 1.3, "linestyle": (0, (4, 1.5, 1, 1.5))}
PASS: Looks = {
    "color": INK, "linewidth": 1.0, "marker": "o", "markersize": 4.0,
    "markerfacecolor": PAPER, "markeredgecolor": INK,
}  # fmt: skip
RETURNS: Looks = {"s": 2.0, "color": QUIET, "alpha": 0.35, "linewidths": 0.0}
RETURNS_MARK: Looks = {"linestyle": "none", "marker": ".", "markersize": 4.0, "color": QUIET}
MOVING_TRACK: Looks = {"edgecolor": VERMILLION, "linewidth": 1.3}
STANDING_TRACK: Looks = {"edgecolor": FAINT, "linewidth": 0.7}
WISH: Looks = {
    "arrowstyle": "-|>", "mutation_scale": 9.0, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 1.2,
    "color": GREEN,
}  # fmt: skip
RING: Looks = {"edgecolor": ORANGE, "linewidth": 1.4}
SENSED: Looks = {"edgecolor": ORANGE, "linewidth": 1.1, "linestyle": (0, (1, 1.8))}
SECTOR: Looks = {"facecolor": ORANGE, "alpha": 0.25, "linewidth": 0.0}
MOTION: Looks = {
    "arrowstyle": "-|>", "mutation_scale": 9.0, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 1.1,
    "color": QUIET,
}  # fmt: skip
ROBOT: Looks = {"facecolor": "#CCE3F0", "edgecolor": BLUE, "linewidth": 1.4}
TANGENT: Looks = {"color": BLUE, "linewidth": 1.2}
MEASURE: Looks = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 1.0, "mutation_scale": 8.0}
SPOKE: Looks = {"color": FAINT, "linewidth": 0.8}
BITS: tuple[Looks, Looks] = (
    {"fontsize": NORMAL + 2, "color": QUIET},
    {"fontsize": NORMAL + 2, "color": VERMILLION, "fontweight": "bold"},
)
JOIN: Looks = {"color": QUIET, "linewidth": 0.9}
CELL: Looks = {"facecolor": PAPER, "edgecolor": QUIET, "linewidth": 0.9}
SET_CELL: Looks = {**CELL, "facecolor": "#F8E6BF"}
FREE_CELL: Looks = {**CELL, "facecolor": "#BFE6DB"}
_ARROW: Looks = {"arrowstyle": "-|>", "mutation_scale": 11.0, "shrinkA": 0.0, "shrinkB": 0.0}
FREE_GAP: Looks = {**_ARROW, "color": GREEN, "linewidth": 1.6}
TAKEN: Looks = {**_ARROW, "color": VERMILLION, "linewidth": 3.0}
CLOSED_GAP: Looks = {"color": ORANGE, "linewidth": 1.4, "linestyle": (0, (1, 1.8))}
WALL: Looks = {"color": INK, "linewidth": 2.6}
LIMIT: Looks = {"edgecolor": INK, "linewidth": 1.8}
# Where the robot stands still its line has no length: a frame marks the position.
_FRAME: Looks = {"markersize": 15.0, "markerfacecolor": "none", "markeredgewidth": 2.2}
STANDING: dict[Mode, Looks] = {
    Mode.BLOCKED: {**_FRAME, "marker": "s"},
    Mode.STOPPED: {**_FRAME, "marker": "8"},
}
_POINT: Looks = {"linestyle": "none", "markeredgecolor": PAPER}
START: Looks = {**_POINT, "marker": "o", "markersize": 10.5, "color": INK}
SMALL_START: Looks = {**START, "markersize": 5.0, "markeredgewidth": 0.0}
GOAL: Looks = {**_POINT, "marker": "*", "markersize": 17.0, "color": GREEN}
PARTICLE: Looks = {**_POINT, "marker": "o", "markersize": 7.5, "color": BLUE}
END: Looks = {**_POINT, "marker": "D", "markersize": 5.5, "color": INK}
NUMBER: Looks = {"ha": "center", "va": "center", "fontsize": SMALL, "color": INK}
HALO: Looks = {"linewidth": 2.5, "foreground": PAPER}

_RC: dict[str, Any] = {
    "font.family": ["DejaVu Sans"],  # comes with matplotlib: the same glyphs everywhere
    "font.size": NORMAL,
    "text.color": INK,
    "text.parse_math": False,  # a name may contain dollar signs
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.labelsize": NORMAL,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-9, 9),
    "axes.unicode_minus": False,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.frameon": False,
    "legend.fontsize": SMALL,
    "figure.dpi": DPI,
    "savefig.dpi": "figure",
    "svg.hashsalt": "mfba",  # ids by content, not random
}


def context() -> AbstractContextManager[None]:
    """Drawing context: this style on matplotlib's defaults, not on the user's settings."""
    from matplotlib import style

    return style.context(_RC, after_reset=True)
