# SPDX-License-Identifier: Apache-2.0
"""Values between the cells of a grid, for code that asks for a few positions very often."""

from __future__ import annotations

import numpy as np

from ..core.geometry import Point

Array = np.ndarray


class BilinearGrid:
    """As distance_field.bilinear(), with the work that does not depend on the position done once.

    Beyond the middles of its outermost cells the nearest values hold.
    """

    def __init__(self, values: Array, origin_m: Point, cell_m: float) -> None:
        """Values (h, w), real or complex, h and w at least 2; [0, 0] begins at origin_m."""
        here, right = values[:-1, :-1], values[:-1, 1:] - values[:-1, :-1]
        above = values[1:, :-1] - here
        across = values[1:, 1:] - values[1:, :-1] - right
        height, self._width = here.shape
        self._parts = np.stack((here, right, above, across), axis=-1).reshape(-1, 4)
        self._scale = 1.0 / cell_m
        self._shift = np.array(origin_m)[:, None] * self._scale + 0.5
        self._last = np.array([[self._width], [height]]) - 1e-9
        (self._shift_x,), (self._shift_y,) = self._shift.tolist()
        (self._last_x,), (self._last_y,) = self._last.tolist()

    def at(self, xy: Array) -> Array:
        """Values (m,) at positions (2, m), m."""
        at = xy * self._scale
        at -= self._shift
        np.maximum(at, 0.0, out=at)
        np.minimum(at, self._last, out=at)
        cell = at.astype(np.int64)
        at -= cell
        u, v = at
        here, right, above, across = self._parts.take(cell[1] * self._width + cell[0], axis=0).T
        found: Array = here + u * right + v * (above + u * across)
        return found

    def at_one(self, x: float, y: float) -> complex:
        """The value at one position: for arrays of one it takes ten times as long."""
        u = min(max(x * self._scale - self._shift_x, 0.0), self._last_x)
        v = min(max(y * self._scale - self._shift_y, 0.0), self._last_y)
        i, j = int(u), int(v)
        u, v = u - i, v - j
        here, right, above, across = self._parts[j * self._width + i].tolist()
        found: complex = here + u * right + v * (above + u * across)
        return found
