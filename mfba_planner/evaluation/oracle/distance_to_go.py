# SPDX-License-Identifier: Apache-2.0
"""Distance to the goal round the walls, for the oracle's searches; the straight line without any.

From Dijkstra's algorithm on a grid of eight neighbours, whose distances exceed those in the plane
by at most the factor 1 / cos(22.5 degrees); so divided by it, and never below the straight line.
A cell is free unless it surely is within the robot's radius of a wall: the distance is estimated
low rather than high. For a path that a robot can follow, more distance is asked of the middles of
cells, except near start and goal.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.geometry import Point
from ...core.segments import Segments
from ...simulation.scenario import Scenario

_STRETCH = 1.0 / math.cos(math.pi / 8.0)
_CELL_M = 0.1
_MOST_CELLS = 400_000
# Every point of a wall is at most 0.75 cells from a marked middle, and a point of a cell 0.71 from
# its own: with so many cells less than the radius a cell is free unless it surely is not.
LOW_CELLS = 1.5
_BORDER_M = 2.0  # beyond start, goal and walls


class DistanceToGo:
    """Distance (m) to the goal of a scenario, at most by rounding above the shortest path."""

    def __init__(self, scenario: Scenario, *, spare_cells: float = -LOW_CELLS) -> None:
        """Search the grid once; spare_cells: beyond the radius, of a free cell's middle."""
        self.goal: Point = scenario.goal_m
        self._spare_cells = spare_cells
        self._grid: np.ndarray | None = None
        if scenario.segments_m:
            self._search(scenario)

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Distances from points, (n,); inf where walls enclose them or the goal."""
        straight: np.ndarray = np.hypot(x - self.goal[0], y - self.goal[1])
        if self._grid is None:
            return straight
        column = np.floor((x - self._low[0]) / self._cell_m).astype(np.intp)
        row = np.floor((y - self._low[1]) / self._cell_m).astype(np.intp)
        rows, columns = self._grid.shape
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        found = self._grid[row * inside, column * inside] / _STRETCH - 2.0 * self._cell_m
        return np.where(inside, np.maximum(straight, found), straight)

    def _search(self, scenario: Scenario) -> None:
        from scipy.ndimage import distance_transform_edt
        from scipy.sparse.csgraph import dijkstra

        radius_m, s = scenario.robot_radius_m, scenario.segments
        corners = np.array([scenario.start_m, scenario.goal_m])
        xs = np.concatenate([corners[:, 0], s.x, s.x + s.dx])
        ys = np.concatenate([corners[:, 1], s.y, s.y + s.dy])
        self._low = (float(xs.min()) - _BORDER_M, float(ys.min()) - _BORDER_M)
        wide = float(xs.max()) + _BORDER_M - self._low[0]
        high = float(ys.max()) + _BORDER_M - self._low[1]
        self._cell_m = max(min(_CELL_M, radius_m / 6.0), math.sqrt(wide * high / _MOST_CELLS))
        shape = (math.ceil(high / self._cell_m), math.ceil(wide / self._cell_m))
        wall = np.zeros(shape, dtype=bool)
        x, y = _points_along(s, 0.5 * self._cell_m)
        wall[self._cells(y, 1), self._cells(x, 0)] = True
        distance_m = distance_transform_edt(~wall) * self._cell_m
        free = distance_m >= radius_m + self._spare_cells * self._cell_m
        if self._spare_cells > -LOW_CELLS:
            for point in (scenario.start_m, scenario.goal_m):
                i, j = (int(self._cells(np.array([v]), axis)[0]) for axis, v in enumerate(point))
                ends = math.ceil(radius_m / self._cell_m)
                near = np.s_[max(0, j - ends) : j + ends, max(0, i - ends) : i + ends]
                free[near] |= distance_m[near] >= radius_m - LOW_CELLS * self._cell_m
        gx, gy = self._cells(np.array(self.goal[:1]), 0), self._cells(np.array(self.goal[1:]), 1)
        graph = _neighbours(free, self._cell_m)
        goal = int(gy[0]) * shape[1] + int(gx[0])
        found, self._next = dijkstra(graph, directed=False, indices=goal, return_predecessors=True)
        self._grid = found.reshape(shape)

    def rough_path(self, start: Point) -> np.ndarray:
        """Points (p, 2) from start to goal through the middles of cells; without one, its ends."""
        points = [start]
        if self._grid is not None:
            columns = self._grid.shape[1]
            column, row = (int(np.floor((v - a) / self._cell_m)) for v, a in zip(start, self._low))
            cell = row * columns + column
            while self._next[cell] >= 0:
                cell = int(self._next[cell])
                row, column = divmod(cell, columns)
                middle = (column + 0.5, row + 0.5)
                points.append(
                    (
                        self._low[0] + middle[0] * self._cell_m,
                        self._low[1] + middle[1] * self._cell_m,
                    )
                )
        return np.array([*points, self.goal])

    def _cells(self, values: np.ndarray, axis: int) -> np.ndarray:
        cells: np.ndarray = np.floor((values - self._low[axis]) / self._cell_m).astype(np.intp)
        return cells


def _points_along(s: Segments, apart_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of all segments, not farther apart than apart_m."""
    x, y, dx, dy = s
    counts = np.ceil(np.hypot(dx, dy) / apart_m).astype(np.intp) + 1
    which = np.repeat(np.arange(len(x)), counts)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    share = (np.arange(len(which)) - first) / (counts[which] - 1)
    return x[which] + share * dx[which], y[which] + share * dy[which]


def _neighbours(free: np.ndarray, cell_m: float) -> object:
    """Sparse graph of free cells and their eight neighbours."""
    from scipy.sparse import coo_array

    number = np.arange(free.size).reshape(free.shape)
    pairs = []
    for a, b, length in (
        (np.s_[:, :-1], np.s_[:, 1:], 1.0),
        (np.s_[:-1, :], np.s_[1:, :], 1.0),
        (np.s_[:-1, :-1], np.s_[1:, 1:], math.sqrt(2.0)),
        (np.s_[1:, :-1], np.s_[:-1, 1:], math.sqrt(2.0)),
    ):
        both = free[a] & free[b]
        start, end = number[a][both], number[b][both]
        pairs.append((start, end, np.full(len(start), length * cell_m)))
    starts, ends, lengths = (np.concatenate(column) for column in zip(*pairs))
    return coo_array((lengths, (starts, ends)), shape=(free.size, free.size)).tocsr()
