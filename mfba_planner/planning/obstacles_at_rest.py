# SPDX-License-Identifier: Apache-2.0
"""Circles at rest around the robot: contact ahead, whether they enclose it, bad returns inside."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..core.geometry import Point
from ..core.planner_types import Circle

AT_REST_MPS = 0.1  # a tracked obstacle that stands still has some velocity
STOPPING_TICKS = 1.5  # until the next decision, which may be to stop, and half a tick of margin
_TOUCHING_M = 1e-6
_DEEP = 0.5  # share of the radius; no obstacle is so deep inside the robot
_ROUNDING = 1e-9
_REMEDY = "check robot_radius_m, and range_min or the mask of the robot's own returns"


def is_at_rest(circle: Circle) -> bool:
    """Whether a circle counts as standing."""
    vx, vy = circle.velocity_mps
    return vx * vx + vy * vy <= AT_REST_MPS * AT_REST_MPS


class ObstaclesAtRest:
    """The circles at rest, relative to the robot. Radii include the robot's, as in Circle."""

    def __init__(self, position: Point, circles: Sequence[Circle]) -> None:
        """Take those of the circles that stand."""
        px, py = position
        self.circles = [circle for circle in circles if is_at_rest(circle)]
        self._rows = [(c.center_m[0] - px, c.center_m[1] - py, c.radius_m) for c in self.circles]

    def rows(self) -> np.ndarray:
        """Rows (x, y, r), m, relative to the robot; (n, 3)."""
        return np.array(self._rows).reshape(-1, 3)

    def misplaced(self) -> str:
        """The reason to stop for a return that no obstacle can have caused, "" without any.

        Every direction leads away from a circle around the robot's centre, so it would not keep
        the robot from driving at all.
        """
        for x, y, r in self._rows:
            d = math.sqrt(x * x + y * y)
            if d < _DEEP * r:
                return f"an obstacle reaches {r - d:.2f} m into the robot; {_REMEDY}"
        return ""

    def allowed_share(self, velocity: Point, duration_s: float) -> float:
        """Share of the velocity, in [0, 1], that brings no contact within the duration.

        0 if it leads nearer to a circle that is in contact already; leading away from it, or
        along its tangent, is allowed.
        """
        ux, uy = velocity
        a = ux * ux + uy * uy
        length, share = math.sqrt(a) * duration_s, 1.0
        for x, y, r in self._rows:
            b = x * ux + y * uy
            if b <= 0.0:
                continue
            away, near = x * x + y * y, r + length
            if away >= near * near or b * b <= _ROUNDING * _ROUNDING * a * away:
                continue
            c = away - r * r
            if c <= 0.0:
                return 0.0
            under_root = b * b - a * c
            if under_root > 0.0:
                # c / (b + root) is (b - root) / a without the cancellation near contact
                share = min(share, c / (b + math.sqrt(under_root)) / duration_s)
        return share

    def enclosure(self) -> str:
        """Why no path leads out between the circles, "" if one does.

        Exact: circles that overlap are joined, and the robot is enclosed if some closed chain of
        them winds around it. A circle in contact is shrunk to touch the robot, so that contact on
        one side does not enclose it.
        """
        n = len(self._rows)
        if n < 3:
            return ""
        x, y, r = np.array(self._rows).T
        d = np.sqrt(x * x + y * y)
        edge = d - r
        r = np.minimum(r, d * (1.0 - _ROUNDING))
        joined, crossed = _overlaps(x, y, r), _crossings(x, y)
        if not _winds(joined, crossed):
            return ""
        touching, nearest_m = int((edge < _TOUCHING_M).sum()), round(float(edge.min()), 2) + 0.0
        reason = f"enclosed by {n} obstacles at rest, the nearest {nearest_m:.2f} m off"
        return f"{reason}, {touching} inside the robot's radius; {_REMEDY}" if touching else reason


def _overlaps(x: np.ndarray, y: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Which circles overlap; (n, n)."""
    across, along, reach = x[:, None] - x, y[:, None] - y, r[:, None] + r
    across *= across
    along *= along
    across += along
    reach *= reach
    overlaps: np.ndarray = across < reach
    return overlaps


def _crossings(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Turns around the origin to add on the step from centre i to j, 1, 0 or -1; (n, n).

    Turns are counted where a step crosses the negative x axis.
    """
    above, below = np.flatnonzero(y >= 0.0), np.flatnonzero(y < 0.0)
    ccw = np.outer(x[above], y[below]) > np.outer(y[above], x[below])
    crossings = np.zeros((len(x), len(x)), dtype=np.int8)
    crossings[np.ix_(above, below)] = ccw
    crossings[np.ix_(below, above)] = -ccw.T.astype(np.int8)
    return crossings


def _winds(joined: np.ndarray, crossed: np.ndarray) -> bool:
    """Whether a closed chain of joined circles winds around the origin.

    Along a chain that does not wind, the turns of a circle do not depend on the path to it.
    """
    n = len(joined)
    turns = np.zeros(n, dtype=int)
    reached = np.zeros(n, dtype=bool)
    for start in range(n):
        if reached[start]:
            continue
        reached[start] = True
        open_ends = [start]
        while open_ends:
            i = open_ends.pop()
            neighbours = np.flatnonzero(joined[i])
            expected = turns[i] + crossed[i, neighbours]
            known = reached[neighbours]
            if (turns[neighbours[known]] != expected[known]).any():
                return True
            turns[neighbours[~known]] = expected[~known]
            reached[neighbours] = True
            open_ends += neighbours[~known].tolist()
    return False
