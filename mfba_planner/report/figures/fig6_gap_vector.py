# SPDX-License-Identifier: Apache-2.0
"""Fig. 6: the gap vector of the paper's example, cell by cell and around the robot."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Rectangle

from mfba_planner.core.geometry import bearing, towards
from mfba_planner.core.planner_types import Bits
from mfba_planner.planning.gap_vector import gap_heading, gap_vector, nearest_free_gap

from .. import style
from ..draw_scene import Z_MARK, Z_PATH, line, patch
from ..figure_sheet import EDGE, Sheet
from ..legend import Entry
from .sketch_elements import EXAMPLE, ORIGIN, draw_ring, example_vs, hide_axes, write

_SIDE, _STRIP, _TALL = 4.2, 5.6, 2.0  # inches
_INNER, _OUTER, _GOAL, _REACH = 0.82, 1.35, 1.6, 1.72  # metres


def draw() -> Figure:
    """Draw how Vs gives Vg, and which gap the robot chooses."""
    vs = example_vs()
    vg = gap_vector(vs)
    sheet = Sheet(EDGE + _STRIP + 0.3 + _SIDE + EDGE, _SIDE + 1.05)
    sheet.head(
        "Fig. 6: the gap vector",
        "gap i lies on the boundary of sectors i and i + 1 and is free when both are: "
        "Vg(i) = Vs(i) or Vs(i + 1), round the ring",
    )
    bottom = EDGE / 2 + 0.5 * (_SIDE - _TALL)
    _strip(sheet.axes(EDGE, bottom, _STRIP, _TALL), vs, vg)
    sheet.legend(_entries(), EDGE + 0.6, bottom - 0.35, ncols=2, columnspacing=2.5)
    _ring(sheet.axes(EDGE + _STRIP + 0.3, EDGE / 2, _SIDE, _SIDE), vs, vg)
    return sheet.figure


def _strip(ax: Axes, vs: Bits, vg: Bits) -> None:
    """Two rows of cells, joined as in Table 1; the first bit is repeated at the end."""
    n = len(vs)
    ax.set_xlim(-1.3, n + 1.1)
    ax.set_ylim(-0.75, 3.9)
    ax.set_axis_off()
    write(ax, (-0.75, 3.0), "Vs", fontsize=style.NORMAL + 1, fontweight="bold")
    write(ax, (-0.75, 0.5), "Vg", fontsize=style.NORMAL + 1, fontweight="bold")
    for i in range(n + 1):
        repeated = i == n
        _cell(ax, i, 2.5, str(vs[i % n]), style.SET_CELL if vs[i % n] else style.CELL, repeated)
        write(ax, (i + 0.5, 3.75), f"S{i % n + 1}", color=style.FAINT if repeated else style.QUIET)
    for i, closed in enumerate(vg):
        looks = style.SET_CELL if closed else style.FREE_CELL
        _cell(ax, i + 0.5, 0.0, str(closed), looks, repeated=False)
        write(ax, (i + 1.0, -0.35), str(i + 1), color=style.QUIET)
        for source in (i + 0.5, i + 1.5):
            line(ax, [(source, 2.45), (i + 1.0, 1.05)], "join", zorder=1.5, **style.JOIN)


def _cell(ax: Axes, x: float, y: float, text: str, looks: style.Looks, repeated: bool) -> None:
    edge = {**looks, "linestyle": (0, (1, 1.8)) if repeated else "-"}
    patch(ax, Rectangle((x + 0.06, y), 0.88, 1.0, zorder=2.0, **edge), "cell")
    ax.text(x + 0.5, y + 0.48, text, ha="center", va="center", zorder=Z_MARK,
            color=style.QUIET if repeated else style.INK)  # fmt: skip


def _ring(ax: Axes, vs: Bits, vg: Bits) -> None:
    """The gaps as directions; the free one nearest to the goal is chosen."""
    hide_axes(ax, _REACH)
    draw_ring(ax, vs, _INNER)
    goal = bearing(ORIGIN, EXAMPLE.goal_m)
    chosen = nearest_free_gap(vg, goal)
    for gap, closed in enumerate(vg, start=1):
        heading = gap_heading(gap, len(vg))
        tip = towards(ORIGIN, heading, _OUTER)
        looks = style.TAKEN if gap == chosen else style.CLOSED_GAP if closed else style.FREE_GAP
        if closed:
            line(ax, [towards(ORIGIN, heading, _INNER), tip], f"gap:{gap}", zorder=Z_PATH, **looks)
        else:
            arrow = FancyArrowPatch(ORIGIN if gap == chosen else towards(ORIGIN, heading, _INNER),
                                    tip, zorder=Z_PATH, **looks)  # fmt: skip
            patch(ax, arrow, f"gap:{gap}")
        write(ax, towards(ORIGIN, heading, _OUTER + 0.14), str(gap),
              fontweight="bold" if gap == chosen else "normal")  # fmt: skip
    star = towards(ORIGIN, goal, _GOAL)
    line(ax, [towards(ORIGIN, goal, _INNER), star], "to goal", zorder=1.6, **style.TRACK)
    line(ax, [star], "goal", zorder=Z_MARK, **style.GOAL)


def _entries() -> list[Entry]:
    """The legend of colours and arrows."""

    def arrow(looks: style.Looks) -> Line2D:
        width = looks["linewidth"]
        return Line2D([], [], color=looks["color"], linewidth=width, marker=">", markersize=5.0)

    return [
        (arrow(style.FREE_GAP), "free gap"),
        (Line2D([], [], **style.CLOSED_GAP), "closed gap"),
        (arrow(style.TAKEN), "free gap nearest to the goal: chosen"),
        (Line2D([], [], **style.GOAL), "direction of the goal"),
    ]
