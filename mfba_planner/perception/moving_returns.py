# SPDX-License-Identifier: Apache-2.0
"""Returns of a scan that must not be marked in the local map: what moves, or moved just now."""

from __future__ import annotations

import math

import numpy as np

from .scan_surfaces import Surfaces

Array = np.ndarray

_CELL_M = 0.1
_LEAST_APPEARED = 2  # returns of a segment in space that was seen free
_REACH_M = 0.6  # along its segment an appeared return counts for others
_AROUND_M = 0.1  # a moving circle


class MovingReturns:
    """Tells moving returns from tracks and free space, and remembers where motion was."""

    def __init__(self, size_m: float) -> None:
        """Start without motion; size_m is the side of the map's window."""
        self._bits = math.ceil(math.log2(size_m / _CELL_M + 4.0))
        self._mask = (1 << self._bits) - 1
        self._last_s = np.empty(0)
        self.clear()

    def clear(self) -> None:
        """Forget all motion."""
        self._last_s = np.full(1 << 2 * self._bits, -np.inf)

    def near_any(self, x: Array, y: Array, moving: Array) -> Array:
        """Whether points (k,) are inside a circle (x, y, vx, vy, r) that moves, or close to it."""
        if not moving.shape[0]:
            return np.zeros(x.size, dtype=bool)
        reach = moving[:, 4] + _AROUND_M
        dx, dy = x[:, None] - moving[:, 0], y[:, None] - moving[:, 1]
        inside: Array = (dx * dx + dy * dy < reach * reach).any(axis=1)
        return inside

    def spread(self, found: Surfaces, appeared: Array) -> Array:
        """Whether returns (k,) are part of something of which at least two returns appeared."""
        count = np.bincount(found.segment[appeared], minlength=found.first.size)
        chosen = np.flatnonzero(appeared & (count[found.segment] >= _LEAST_APPEARED))
        flagged = np.zeros(found.x.size, dtype=bool)
        if not chosen.size:
            return flagged
        same = np.flatnonzero(count[found.segment] >= _LEAST_APPEARED)
        dx = found.x[same, None] - found.x[chosen]
        dy = found.y[same, None] - found.y[chosen]
        near = dx * dx + dy * dy < _REACH_M * _REACH_M
        near &= found.segment[same, None] == found.segment[chosen]
        flagged[same] = near.any(axis=1)
        return flagged

    def remember(self, x: Array, y: Array, time_s: float) -> None:
        """Something moved at these points (k,) of the map's frame."""
        if x.size:
            self._last_s[self._cells(x, y, np.arange(-1, 2)).ravel()] = time_s

    def recent(self, x: Array, y: Array, since_s: float) -> Array:
        """Whether something moved near these points (k,) since then."""
        recent: Array = (
            self._last_s[self._cells(x, y, np.zeros(1, dtype=np.int64))[:, 0]] > since_s
        )
        return recent

    def _cells(self, x: Array, y: Array, step: Array) -> Array:
        ix = (np.floor(x / _CELL_M).astype(np.int64)[:, None] + step) & self._mask
        iy = (np.floor(y / _CELL_M).astype(np.int64)[:, None] + step) & self._mask
        cells = (iy[:, :, None] << self._bits) + ix[:, None, :]
        return cells.reshape(x.size, step.size**2)
