# SPDX-License-Identifier: Apache-2.0
"""Points of the local map: at most one measured point per cell of a rolling grid."""

from __future__ import annotations

import math

import numpy as np

Array = np.ndarray

ROWS = 10
X, Y, FIRST, LAST, HITS, MISSED, WEAK, WIDTH, NX, NY = range(ROWS)  # of data
NONE = -1


class MapPoints:
    """Points with real coordinates, found through the cells of a grid that wraps around.

    data (ROWS, n): x, y (m); when first and last seen (s); scans that met the point; scans in a
    row that saw through it; scans that ended a little behind it; width of the surface that it is
    on (m); its normal towards the lidar when it was last seen.
    The grid has 2^k cells along a side, so that a cell is found by masking its coordinates.
    """

    def __init__(self, cell_m: float, size_m: float) -> None:
        """Start without points; size_m is the side of the square that is kept."""
        self.cell_m, self.half_m = cell_m, 0.5 * size_m
        self._bits = math.ceil(math.log2(size_m / cell_m + 2.0))
        self._mask = (1 << self._bits) - 1
        self._slot = np.full(1 << 2 * self._bits, NONE, dtype=np.int32)
        self._cell = np.empty(0, dtype=np.int64)
        self.data = np.empty((ROWS, 0))

    @property
    def count(self) -> int:
        """Number of points."""
        return self.data.shape[1]

    def clear(self) -> None:
        """Drop all points."""
        self.keep(np.zeros(self.count, dtype=bool))

    def _cells(self, x: Array, y: Array) -> Array:
        ix = np.floor(x / self.cell_m).astype(np.int64) & self._mask
        iy = np.floor(y / self.cell_m).astype(np.int64) & self._mask
        cells: Array = (iy << self._bits) | ix
        return cells

    def nearest(self, x: Array, y: Array, reach: int = 1) -> tuple[Array, Array]:
        """Index (k,) of the nearest point within that many cells of each position, and distance.

        NONE and inf where there is none.
        """
        if not (self.count and x.size):
            return np.full(x.size, NONE), np.full(x.size, np.inf)
        step = np.arange(-reach, reach + 1)
        ix = (np.floor(x / self.cell_m).astype(np.int64)[:, None] + step) & self._mask
        iy = (np.floor(y / self.cell_m).astype(np.int64)[:, None] + step) & self._mask
        cells = (iy[:, :, None] << self._bits) + ix[:, None, :]
        slot = self._slot.take(cells.reshape(x.size, step.size**2))
        # Of an empty cell the slot is NONE, the last column: that of no point.
        places = np.full((2, self.count + 1), np.inf)
        places[:, :-1] = self.data[:2]
        dx, dy = places[0].take(slot, mode="wrap"), places[1].take(slot, mode="wrap")
        dx -= x[:, None]
        dy -= y[:, None]
        dx *= dx
        dy *= dy
        dx += dy
        best = dx.argmin(axis=1)
        best += np.arange(0, slot.size, slot.shape[1])
        return slot.ravel()[best].astype(np.int64), np.sqrt(dx.ravel()[best])

    def add(self, x: Array, y: Array, time_s: float, width_m: Array, nx: Array, ny: Array) -> int:
        """Add a point in each empty cell; of several in one cell the first. How many were.

        nx and ny are the normals towards the lidar.
        """
        cell = self._cells(x, y)
        chosen = np.sort(np.unique(cell, return_index=True)[1])
        chosen = chosen[self._slot[cell[chosen]] == NONE]
        if not chosen.size:
            return 0
        new = np.zeros((ROWS, chosen.size))
        new[X], new[Y] = x[chosen], y[chosen]
        new[FIRST] = new[LAST] = time_s
        new[HITS], new[WIDTH] = 1.0, width_m[chosen]
        new[NX], new[NY] = nx[chosen], ny[chosen]
        self._slot[cell[chosen]] = np.arange(self.count, self.count + chosen.size)
        self.data = np.concatenate((self.data, new), axis=1)
        self._cell = np.concatenate((self._cell, cell[chosen]))
        return int(chosen.size)

    def keep(self, kept: Array) -> None:
        """Drop the points where kept (n,) is False."""
        self._slot[self._cell] = NONE
        self.data = self.data[:, kept]
        self._cell = self._cell[kept]
        self._slot[self._cell] = np.arange(self._cell.size)

    def move(self, index: Array, x: Array, y: Array) -> bool:
        """Move points; one that comes into the cell of another is dropped. Whether any was."""
        self.data[X, index], self.data[Y, index] = x, y
        cell = self._cells(x, y)
        left = np.flatnonzero(cell != self._cell[index])
        if not left.size:
            return False
        first = np.unique(cell[left], return_index=True)[1]
        first = left[first[self._slot[cell[left[first]]] == NONE]]
        kept = np.ones(self.count, dtype=bool)
        kept[index[left]] = False
        kept[index[first]] = True
        self._slot[self._cell] = NONE
        self._cell[index[first]] = cell[first]
        self.data, self._cell = self.data[:, kept], self._cell[kept]
        self._slot[self._cell] = np.arange(self._cell.size)
        return first.size < left.size

    def roll(self, x: float, y: float) -> bool:
        """Drop points outside the square around (x, y). Whether any was."""
        outside = np.abs(self.data[X] - x) > self.half_m
        outside |= np.abs(self.data[Y] - y) > self.half_m
        if not outside.any():
            return False
        self.keep(~outside)
        return True
