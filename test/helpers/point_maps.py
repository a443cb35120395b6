# SPDX-License-Identifier: Apache-2.0
"""Local maps of given points, for tests of what plans on them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from mfba_planner.core.geometry import Point
from mfba_planner.perception.distance_field import DistanceField
from mfba_planner.perception.static_map import StaticMap

SPACING_M = 0.04  # of the points of a wall, below the side of a cell


def polyline(*corners: Point) -> list[Point]:
    """Points along walls from corner to corner."""
    found = []
    for (x0, y0), (x1, y1) in zip(corners, corners[1:]):
        n = max(math.ceil(math.dist((x0, y0), (x1, y1)) / SPACING_M), 1)
        found += [(x0 + (x1 - x0) * k / n, y0 + (y1 - y0) * k / n) for k in range(n + 1)]
    return found


class PointMap(StaticMap):
    """A map without scans: points are added by hand, and fields are counted."""

    def __init__(self, points: Iterable[Point] = ()) -> None:
        """Start with some points."""
        super().__init__()
        self.fields = 0
        self._time_s = 1e3  # all points have been there for long
        self.mark(list(points))

    def mark(self, points: Sequence[Point]) -> None:
        """Add points, at most one per cell."""
        if points:
            x, y = np.array(points, dtype=float).T
            zero = np.zeros(x.size)
            self._points.add(x, y, 0.0, zero, zero + 1.0, zero)
            self.version += 1

    def rectangle_field(self, low: Point, high: Point, cell_m: float) -> DistanceField:
        """StaticMap.rectangle_field(), counted."""
        self.fields += 1
        return super().rectangle_field(low, high, cell_m)

    def least_m(self, path: np.ndarray) -> float:
        """Smallest distance of positions (k, 2) from the points."""
        points = self.map_points()
        away = path[:, None, :] - points[None, :, :]
        return float(np.sqrt((away * away).sum(axis=2)).min(initial=math.inf))
