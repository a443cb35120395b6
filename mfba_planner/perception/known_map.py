# SPDX-License-Identifier: Apache-2.0
"""A map that was known before the drive (nav_msgs/OccupancyGrid), as points of its outline.

As Nav2's static layer: from OCCUPIED_FROM on a cell is occupied; what is unknown counts as free.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.errors import InputError
from ..core.geometry import Point
from .occupancy_grid import OccupancyGrid
from .scan_beams import Beams, clear_lengths

Array = np.ndarray

MOST_CELLS = 25_000_000  # of a map: 250 m x 250 m of 5 cm
FINEST_M, COARSEST_M = 0.001, 10.0  # of a cell
FARTHEST_M = 1e6  # of its origin
OCCUPIED_FROM = 65  # as Nav2's lethal_cost_threshold of a map from map_saver
MOST_POINTS = 500_000
_POINT_M = 0.05  # points are about so far apart
_LEVEL_RAD = 1e-6  # a yaw that is rounding
_SCANS = 2  # in a row that must see through a point
_BEHIND_M = 0.3  # they must end so much behind it: a cell is not where its wall is exactly
_TURN_SD_RAD = 0.01
_LINE_M = 5.0  # a line is looked at in parts of this length


class KnownMap:
    """Points (n, 2) on the outline of what is occupied, m, in odom, sorted by x."""

    def __init__(self, points_m: Array) -> None:
        """Take the points in any order."""
        self.points_m: Array = points_m[np.lexsort((points_m[:, 1], points_m[:, 0]))]

    def __eq__(self, other: object) -> bool:
        """Whether the points are the same."""
        return isinstance(other, KnownMap) and np.array_equal(self.points_m, other.points_m)

    __hash__ = None  # type: ignore[assignment]

    @property
    def count(self) -> int:
        """Number of points."""
        return int(self.points_m.shape[0])

    def near(self, low: Point, high: Point) -> Array:
        """Indices (k,) of the points between two corners."""
        x, y = self.points_m[:, 0], self.points_m[:, 1]
        first, end = np.searchsorted(x, (low[0], high[0]))
        y = y[first:end]
        found: Array = first + np.flatnonzero((y >= low[1]) & (y <= high[1]))
        return found


def known_map(grid: OccupancyGrid) -> KnownMap:
    """The map of a grid. Raises InputError naming what cannot be used, and the remedy."""
    check_cells(*grid.cells.shape)
    size_m, origin = grid.cell_m, grid.origin
    if not FINEST_M <= size_m <= COARSEST_M:
        raise InputError(
            f"map has resolution={size_m:g} m: not from {FINEST_M:g} to {COARSEST_M:g} m; "
            "save it with another resolution"
        )
    if not max(abs(origin.x), abs(origin.y)) <= FARTHEST_M:
        raise InputError(
            f"map has its origin at ({origin.x:g}, {origin.y:g}): farther than {FARTHEST_M:g} m "
            "from 0; check its publisher"
        )
    if abs(origin.yaw) > _LEVEL_RAD:
        raise InputError(
            f"map is rotated by {origin.yaw:g} rad, which is not supported; save it with yaw 0"
        )
    occupied = grid.cells >= OCCUPIED_FROM
    inside = occupied.copy()  # all four neighbours are occupied too
    inside[[0, -1]] = inside[:, [0, -1]] = False
    inside[1:-1, 1:-1] &= occupied[:-2, 1:-1] & occupied[2:, 1:-1]
    inside[1:-1, 1:-1] &= occupied[1:-1, :-2] & occupied[1:-1, 2:]
    row, column = np.nonzero(occupied & ~inside)
    parts = max(math.ceil(size_m / _POINT_M - 1e-6), 1)
    dx, dy = _rim(parts)
    if row.size * dx.size > MOST_POINTS and size_m >= _POINT_M:
        raise _too_many()
    x = origin.x + (column[:, None] + dx).ravel() * size_m
    y = origin.y + (row[:, None] + dy).ravel() * size_m
    if size_m < _POINT_M:  # of a finer map one cell in _POINT_M
        i, j = np.floor(x / _POINT_M).astype(np.int64), np.floor(y / _POINT_M).astype(np.int64)
        _, first = np.unique(np.stack((j, i), axis=1), axis=0, return_index=True)
        if first.size > MOST_POINTS:
            raise _too_many()
        x, y = x[first], y[first]
    return KnownMap(np.stack((x, y), axis=1))


def check_cells(height: int, width: int) -> None:
    """Raise InputError for a map of no cells or of too many."""
    if not 0 < height * width <= MOST_CELLS:
        raise InputError(
            f"map has {width} x {height} cells: not from 1 to {MOST_CELLS}; "
            "crop it, or save it coarser"
        )


def _too_many() -> InputError:
    return InputError(
        f"map has more than {MOST_POINTS} points on the outline of what is occupied; "
        "remove its specks, crop it, or save it coarser"
    )


def _rim(parts: int) -> tuple[Array, Array]:
    """Points of the rim of a cell cut into parts x parts, as shares of its side."""
    at = np.arange(parts)
    j, i = (one.ravel() for one in np.meshgrid(at, at, indexing="ij"))
    outer = (i == 0) | (j == 0) | (i == parts - 1) | (j == parts - 1)
    return (i[outer] + 0.5) / parts, (j[outer] + 0.5) / parts


class UnclearedMap:
    """The points of a known map but those that the lidar has seen through.

    The map lies in the frame of the local map. version rises when points are dropped.
    """

    def __init__(self, known: KnownMap, spacing_m: float) -> None:
        """All points count; where neighbouring beams are farther apart nothing is dropped."""
        self._known, self._spacing_m = known, spacing_m
        self._missed = np.zeros(known.count, dtype=np.int8)  # scans in a row that saw through
        self.version = 0

    def near(self, low: Point, high: Point) -> Array:
        """Points (k, 2) between two corners."""
        return self._known.points_m[self._near(low, high)]

    def along(self, start: Point, end: Point, room_m: float) -> Array:
        """Points (k, 2) near a line: all that are nearer to it than room_m, and others."""
        (x0, y0), (x1, y1) = start, end
        parts = max(math.ceil(max(abs(x1 - x0), abs(y1 - y0)) / _LINE_M), 1)
        found = []
        for k in range(parts):
            ax, bx = (x0 + (x1 - x0) * m / parts for m in (k, k + 1))
            ay, by = (y0 + (y1 - y0) * m / parts for m in (k, k + 1))
            low = (min(ax, bx) - room_m, min(ay, by) - room_m)
            found.append(self.near(low, (max(ax, bx) + room_m, max(ay, by) + room_m)))
        return np.concatenate(found)

    def bounds(self) -> tuple[Point, Point]:
        """The corners of all points."""
        (x0, y0), (x1, y1) = (f(self._known.points_m, axis=0).tolist() for f in (np.min, np.max))
        return (x0, y0), (x1, y1)

    def _near(self, low: Point, high: Point) -> Array:
        found = self._known.near(low, high)
        kept: Array = found[self._missed[found] < _SCANS]
        return kept

    def update(self, beams: Beams, position: Point, turn_rad: float) -> None:
        """Drop what the beams of a scan from this position see through.

        turn_rad is the turn from odom, in which the beams are, to the frame of the map.
        """
        if not beams.range_m.size:
            return
        reach, (x, y) = min(beams.longest_m, self._spacing_m / beams.spacing_rad), position
        near = self._near((x - reach, y - reach), (x + reach, y + reach))
        dx, dy = (self._known.points_m[near] - position).T
        away = np.sqrt(dx * dx + dy * dy)
        clear, _ = clear_lengths(beams, np.arctan2(dy, dx) - turn_rad, _TURN_SD_RAD)
        through = (away < reach) & (clear - away > _BEHIND_M + 0.5 * away * beams.spacing_rad)
        self._missed[near] = np.where(through, self._missed[near] + 1, 0)
        self.version += bool((self._missed[near] >= _SCANS).any())
