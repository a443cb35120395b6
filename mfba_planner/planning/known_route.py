# SPDX-License-Identifier: Apache-2.0
"""The shortest way through a known map to a goal that the local map does not reach."""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, distance
from ..perception.distance_field import DistanceField, distance_field
from ..perception.known_map import UnclearedMap
from .eikonal import cell_of, downhill, march, speed_share

Array = np.ndarray

_CELL_M, _COARSEST_M = 0.1, 0.2  # of the grid
_MOST_CELLS = 250_000  # about 0.1 s, once per goal
_MARGIN_M, _BESIDE_M = 4.0, 30.0  # around the map; around robot and goal if it is too large
_CLOSED_SHARE = 0.75  # of a cell: so near to a wall its middle is closed, or walls would leak
_CAP_M = 0.8
_SAME_GOAL_M = 0.1
_LOCAL_M = 12.0  # side of the square that holds the next part of the way
_STEP_M = 0.3
_PROGRESS_M, _PATIENCE_NS = 1.0, 10_000_000_000


class KnownRoute:
    """Distance to go in the whole known map: computed for a goal, and where nothing gets nearer.

    All positions are in the map's frame.
    """

    def __init__(self, known_map: UnclearedMap, radius_m: float) -> None:
        """radius_m is the robot's."""
        self._known_map, self._radius_m = known_map, radius_m
        self._goal: Point | None = None
        self._to_go = DistanceField((0.0, 0.0), 1.0, np.zeros((2, 2)), math.inf)
        self._down = np.zeros((2, 2, 2))
        self._best_m, self._best_ns = math.inf, 0

    def part(
        self, stamp_ns: int, position: Point, goal: Point, stands: Array
    ) -> tuple[Point, float, Point, Point]:
        """The end of the next part of the way, what is to go from there (m), its two corners.

        stands (n, 2) is what stands by the lidar: looked at when the way is computed.
        """
        new = self._goal is None or distance(self._goal, goal) >= _SAME_GOAL_M
        if new or not math.isfinite(self._at(position)):
            self._compute(stamp_ns, position, goal, stands)
        elif self._at(position) < self._best_m - _PROGRESS_M:
            self._best_m, self._best_ns = self._at(position), stamp_ns
        elif stamp_ns - self._best_ns > _PATIENCE_NS:
            self._compute(stamp_ns, position, goal, stands)
        return self._walk(position, goal)

    def _at(self, point: Point) -> float:
        return float(self._to_go.at(np.array([point[0]]), np.array([point[1]]))[0])

    def _walk(self, position: Point, goal: Point) -> tuple[Point, float, Point, Point]:
        (x, y), field = position, self._to_go
        low = high = position
        for _ in range(math.ceil(4.0 * _LOCAL_M / _STEP_M)):
            if distance((x, y), goal) < 2.0 * _STEP_M:
                return goal, 0.0, _least(low, goal), _most(high, goal)
            j, i = cell_of((x, y), field.origin_m, field.cell_m, field.distance_m.shape)
            ux, uy = self._down[:, j, i].tolist()
            ahead = (x + _STEP_M * ux, y + _STEP_M * uy)
            wide = (_least(low, ahead), _most(high, ahead))
            if max(wide[1][0] - wide[0][0], wide[1][1] - wide[0][1]) > _LOCAL_M:
                break
            (x, y), (low, high) = ahead, wide
        return (x, y), self._at((x, y)), low, high

    def _compute(self, stamp_ns: int, position: Point, goal: Point, stands: Array) -> None:
        low, high, cell = self._domain(position, goal)
        points = np.concatenate((self._known_map.near(low, high), stands))
        x, y = points.T
        field = distance_field(x, y, low, high, cell, _CAP_M)
        speed = speed_share(field.distance_m, max(self._radius_m, _CLOSED_SHARE * cell))
        to_go = march(speed, cell_of(goal, field.origin_m, cell, speed.shape), cell)
        down = downhill(to_go)
        self._down = np.stack((down.real, down.imag))
        self._to_go = DistanceField(field.origin_m, cell, to_go, math.inf)
        self._goal, self._best_m, self._best_ns = goal, self._at(position), stamp_ns

    def _domain(self, position: Point, goal: Point) -> tuple[Point, Point, float]:
        """Corners and cell: all of the map if it is not too large, and robot and goal."""
        ends = _least(position, goal), _most(position, goal)
        known = self._known_map.bounds()
        low = _least(*(_moved(p, -_MARGIN_M) for p in (known[0], ends[0])))
        high = _most(*(_moved(p, _MARGIN_M) for p in (known[1], ends[1])))
        if _cell_m(low, high) > _COARSEST_M:
            low = _most(low, _moved(ends[0], -_BESIDE_M))
            high = _least(high, _moved(ends[1], _BESIDE_M))
        return low, high, _cell_m(low, high)


def _cell_m(low: Point, high: Point) -> float:
    area = (high[0] - low[0]) * (high[1] - low[1])
    return max(_CELL_M, math.sqrt(area / _MOST_CELLS))


def _moved(point: Point, by_m: float) -> Point:
    return (point[0] + by_m, point[1] + by_m)


def _least(a: Point, b: Point) -> Point:
    return (min(a[0], b[0]), min(a[1], b[1]))


def _most(a: Point, b: Point) -> Point:
    return (max(a[0], b[0]), max(a[1], b[1]))
