# SPDX-License-Identifier: Apache-2.0
"""Draw what a real robot perceived, and where its planner wanted to go, beneath its path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.patches import Circle, FancyArrowPatch

from mfba_planner.core.planner_types import Mode
from mfba_planner.recording.perceived import Perceived
from mfba_planner.simulation.episode import Episode

from . import style
from .draw_scene import Z_OBSTACLE, Z_RING, Z_TRACK, patch
from .run_events import is_finite
from .view_bounds import View, fitted

_MOST_SCANS, _MOST_MOMENTS = 60, 12
_WISH_S, _AHEAD_S = 1.0, 2.0  # over which an arrow shows a velocity
_AROUND_M = 3.0  # of the path: farther returns are left out, for a larger path
_DRIVING = (Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE)


def widened(view: View, perceived: Sequence[Perceived]) -> tuple[View, float]:
    """The view that also holds the returns near it, and its scale in inches per metre."""
    wide = view.grown(_AROUND_M, _AROUND_M)
    found = view
    for moment in _evenly(perceived, _MOST_SCANS):
        x, y = moment.points_m.T
        near = (x > wide.left) & (x < wide.right) & (y > wide.bottom) & (y < wide.top)
        if near.any():
            low, high = moment.points_m[near].min(axis=0), moment.points_m[near].max(axis=0)
            found = found.around(tuple(low.tolist())).around(tuple(high.tolist()))
    return fitted(found.grown(0.1, 0.1))


def draw_perceived(ax: Axes, perceived: Sequence[Perceived]) -> None:
    """Draw the returns of some scans, and the tracks at some moments."""
    moments = _evenly(perceived, _MOST_SCANS)
    points = np.concatenate([m.points_m for m in moments]) if moments else np.empty((0, 2))
    if len(points):
        dots: PathCollection = ax.scatter(*points.T, zorder=Z_TRACK, **style.RETURNS)
        dots.set_gid("returns")
    for number, moment in enumerate(_evenly(perceived, _MOST_MOMENTS)):
        for track in moment.tracks:
            is_moving = track.velocity_mps != (0.0, 0.0)
            looks = style.MOVING_TRACK if is_moving else style.STANDING_TRACK
            circle = Circle(track.center_m, track.radius_m, fill=False, zorder=Z_OBSTACLE, **looks)
            patch(ax, circle, f"{'moving' if is_moving else 'resting'}:{number}")
            if is_moving:
                (x, y), (vx, vy) = track.center_m, track.velocity_mps
                tip = (x + _AHEAD_S * vx, y + _AHEAD_S * vy)
                arrow = FancyArrowPatch((x, y), tip, zorder=Z_OBSTACLE, **style.MOTION)
                patch(ax, arrow, f"moving:{number}")


def draw_wishes(ax: Axes, episode: Episode) -> None:
    """Draw the decided velocity at some ticks: where the planner wanted to go from there."""
    driving = [
        tick
        for tick in episode.ticks
        if tick.mode in _DRIVING and is_finite(tick.pose.position) and any(tick.velocity)
    ]
    for tick in _evenly(driving, 2 * _MOST_MOMENTS):
        (x, y), (vx, vy) = tick.pose.position, tick.velocity
        tip = (x + _WISH_S * vx, y + _WISH_S * vy)
        patch(ax, FancyArrowPatch((x, y), tip, zorder=Z_RING, **style.WISH), "wish")


def _evenly(items: Sequence[object], most: int) -> list:  # type: ignore[type-arg]
    """At most so many items, evenly apart, the last one included."""
    step = max(1, -(-len(items) // most))
    return list(items[::-step])[::-1]
