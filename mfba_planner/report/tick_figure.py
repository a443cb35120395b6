# SPDX-License-Identifier: Apache-2.0
"""One tick of a run as a close-up picture: obstacles, sectors, gaps, waypoint."""

from __future__ import annotations

from collections.abc import Sequence

from mfba_planner.simulation.episode import Episode

from . import legend, style
from .draw_tick import draw_snapshot
from .figure_sheet import EDGE, Sheet, to_bytes

_SIDE, _HEAD, _AXIS, _PANEL = 5.0, 0.85, 0.6, 2.6  # inches
_AROUND = 3.0  # sensing ranges shown around the robot


def tick_png(episode: Episode, index: int, title: str, lines: Sequence[str]) -> bytes:
    """The robot's surroundings at tick index (from 0) as PNG, with title and subtitle."""
    with style.context():
        sheet = Sheet(EDGE + _AXIS + _SIDE + EDGE + _PANEL, _AXIS + EDGE + _SIDE + _HEAD)
        sheet.head(title, lines[0] if lines else "")
        left, bottom = EDGE + _AXIS, EDGE + _AXIS
        ax = sheet.axes(left, bottom, _SIDE, _SIDE)
        draw_snapshot(ax, episode, index)
        tick = episode.ticks[index]
        reach = _AROUND * episode.sensor.sensing_range_m
        ax.set_xlim(tick.pose.x - reach, tick.pose.x + reach)
        ax.set_ylim(tick.pose.y - reach, tick.pose.y + reach)
        ax.set_aspect("equal")
        ax.set_xlabel("x (m)")
        ax.set_ylabel("y (m)")
        ax.tick_params(length=0.0, pad=5.0)
        ax.annotate(
            "",
            xy=tick.waypoint,
            xytext=tick.pose.position,
            arrowprops={"arrowstyle": "->", "color": style.INK},
        )
        sheet.legend(legend.entries(ax), left + _SIDE + EDGE, bottom + _SIDE)
        return to_bytes(sheet.figure, "png")
