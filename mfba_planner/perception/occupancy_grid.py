# SPDX-License-Identifier: Apache-2.0
"""The local map as an occupancy grid: occupied, free and unknown cells."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..core.geometry import Point, Pose2D
from .scan_beams import Beams

Array = np.ndarray

OCCUPIED, FREE, UNKNOWN = 100, 0, -1
_CELL_M = 0.2
_EVERY_S = 0.5


class OccupancyGrid(NamedTuple):
    """A map at a time, as nav_msgs/OccupancyGrid: cells (h, w) int8, row by row from the origin.

    origin is the pose, in odom, of the outer corner of the first cell.
    """

    stamp_ns: int
    origin: Pose2D
    cell_m: float
    cells: Array

    def occupied(self) -> Array:
        """Centres (n, 2) of the occupied cells, m, in odom."""
        row, column = np.nonzero(self.cells == OCCUPIED)
        dx, dy = (column + 0.5) * self.cell_m, (row + 0.5) * self.cell_m
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        x, y = self.origin.x + (c * dx - s * dy), self.origin.y + (s * dx + c * dy)
        return np.stack((x, y), axis=1)


class ObservedCells:
    """Coarse cells that a beam has passed, in a window that rolls with the robot."""

    def __init__(self, size_m: float) -> None:
        """Start with nothing seen; size_m is the side of the window."""
        self._n = 2 * math.ceil(0.5 * size_m / _CELL_M)
        self.clear()

    def clear(self) -> None:
        """Nothing is seen."""
        self._low = (0, 0)
        self._observed = np.zeros((self._n, self._n), dtype=bool)
        self._last_s: float | None = None

    def update(self, time_s: float, x: float, y: float, turn_rad: float, beams: Beams) -> None:
        """Add the beams of a scan from (x, y), if the last one was not a moment ago.

        turn_rad is the error of the heading.
        """
        if self._last_s is not None and time_s - self._last_s < _EVERY_S:
            return
        if not beams.range_m.size:
            return
        self._last_s = time_s
        self._roll(math.floor(x / _CELL_M) - self._n // 2, math.floor(y / _CELL_M) - self._n // 2)
        reach = np.zeros(beams.count)
        reach[beams.number] = np.minimum(beams.range_m, beams.longest_m)
        k = math.ceil(min(float(reach.max()) / _CELL_M + 1.0, 0.5 * self._n))
        low = self._n // 2 - k
        at = np.arange(low, low + 2 * k)
        dx = (at + self._low[0] + 0.5) * _CELL_M - x
        dy = ((at + self._low[1] + 0.5) * _CELL_M - y)[:, None]
        number = beams.index_of(np.arctan2(dy, dx) + turn_rad)
        inside = (number >= 0) & (number < beams.count)
        passed = reach[np.where(inside, number, 0)]
        met = inside & (dx * dx + dy * dy <= passed * passed)
        self._observed[low : low + 2 * k, low : low + 2 * k] |= met

    def _roll(self, i: int, j: int) -> None:
        di, dj = i - self._low[0], j - self._low[1]
        self._low = (i, j)
        if not (di or dj):
            return
        old, n = self._observed, self._n
        self._observed = np.zeros((n, n), dtype=bool)
        if abs(di) < n and abs(dj) < n:
            to_x, to_y = slice(max(-di, 0), n - max(di, 0)), slice(max(-dj, 0), n - max(dj, 0))
            of_x, of_y = slice(max(di, 0), n - max(-di, 0)), slice(max(dj, 0), n - max(-dj, 0))
            self._observed[to_y, to_x] = old[of_y, of_x]

    def at(self, x: Array, y: Array) -> Array:
        """Whether positions (any shape, broadcast) have been seen."""
        i = np.floor(x / _CELL_M).astype(np.int64) - self._low[0]
        j = np.floor(y / _CELL_M).astype(np.int64) - self._low[1]
        n = self._n
        inside = (i >= 0) & (j >= 0) & (i < n) & (j < n)
        found: Array = inside & self._observed[np.clip(j, 0, n - 1), np.clip(i, 0, n - 1)]
        return found


def occupancy(
    x: Array, y: Array, center: Point, size_m: float, cell_m: float, observed: ObservedCells
) -> tuple[Point, Array]:
    """Origin and cells (n, n) int8 of a square around the centre, from points (k,)."""
    n = math.ceil(size_m / cell_m)
    i0 = math.floor((center[0] - 0.5 * size_m) / cell_m)
    j0 = math.floor((center[1] - 0.5 * size_m) / cell_m)
    at = np.arange(n) + 0.5
    free = observed.at((i0 + at) * cell_m, ((j0 + at) * cell_m)[:, None])
    cells = np.where(free, FREE, UNKNOWN).astype(np.int8)
    i = np.floor(x / cell_m).astype(np.int64) - i0
    j = np.floor(y / cell_m).astype(np.int64) - j0
    inside = (i >= 0) & (j >= 0) & (i < n) & (j < n)
    cells[j[inside], i[inside]] = OCCUPIED
    return (i0 * cell_m, j0 * cell_m), cells


def cut_to_known(origin: Point, cells: Array, cell_m: float) -> tuple[Point, Array]:
    """The smallest part that holds all known cells; the middle cell if none is known."""
    known = cells != UNKNOWN
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not rows.size:
        rows, columns = (np.array([n // 2]) for n in cells.shape)
    (j, above), (i, right) = rows[[0, -1]].tolist(), columns[[0, -1]].tolist()
    part = cells[j : above + 1, i : right + 1]
    return (origin[0] + i * cell_m, origin[1] + j * cell_m), part
