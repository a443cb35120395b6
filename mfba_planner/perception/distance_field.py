# SPDX-License-Identifier: Apache-2.0
"""Distance to the nearest of many points, on a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point

Array = np.ndarray


@dataclass(frozen=True, slots=True)
class DistanceField:
    """distance_m[j, i] belongs to origin_m + ((i + 0.5) cell_m, (j + 0.5) cell_m)."""

    origin_m: Point
    cell_m: float
    distance_m: Array  # (h, w)
    cap_m: float

    def at(self, x: Array, y: Array) -> Array:
        """Bilinear interpolation at positions of any shape; the cap outside."""
        field, flat = self.distance_m, self.distance_m.ravel()
        height, width = field.shape
        u = (x - self.origin_m[0]) / self.cell_m - 0.5
        v = (y - self.origin_m[1]) / self.cell_m - 0.5
        inside = (u >= 0.0) & (v >= 0.0) & (u < width - 1) & (v < height - 1)
        u, v = np.where(inside, u, 0.0), np.where(inside, v, 0.0)
        i, j = u.astype(np.int64), v.astype(np.int64)
        u, v = u - i, v - j
        k = j * width + i
        low = flat[k] * (1.0 - u) + flat[k + 1] * u
        k += width
        high = flat[k] * (1.0 - u) + flat[k + 1] * u
        return np.where(inside, low + v * (high - low), self.cap_m)


def distance_field(
    x: Array, y: Array, center: Point, window_m: float, cell_m: float, cap_m: float
) -> DistanceField:
    """Distances (m, at most cap_m) to points (n,) in a square around the centre.

    The grid is aligned with multiples of cell_m. The nearest occupied cell is that of the
    Euclidean distance transform; the distance is that to the nearest of the points in it and in
    the nearest cells of the four neighbours, not to its centre.
    """
    n = max(math.ceil(window_m / cell_m), 2)
    pad = math.ceil(cap_m / cell_m) + 1  # points outside the window count as well
    i0 = math.floor((center[0] - 0.5 * window_m) / cell_m) - pad
    j0 = math.floor((center[1] - 0.5 * window_m) / cell_m) - pad
    size = n + 2 * pad
    i = np.floor(x / cell_m).astype(np.int64) - i0
    j = np.floor(y / cell_m).astype(np.int64) - j0
    inside = (i >= 0) & (j >= 0) & (i < size) & (j < size)
    origin = ((i0 + pad) * cell_m, (j0 + pad) * cell_m)
    if not inside.any():
        return DistanceField(origin, cell_m, np.full((n, n), cap_m), cap_m)
    from scipy.ndimage import distance_transform_edt  # loads in 0.1 s, and only here

    cells = j[inside] * size + i[inside]
    px, py = np.zeros((2, size * size), dtype=np.float32)  # relative to the origin: to 1 um
    px[cells], py[cells] = x[inside] - origin[0], y[inside] - origin[1]
    empty = np.ones(size * size, dtype=bool)
    empty[cells] = False
    near = distance_transform_edt(
        empty.reshape(size, size), return_distances=False, return_indices=True
    )
    index = near[0] * size + near[1]
    qx, qy = px.take(index), py.take(index)
    at = ((np.arange(n) + 0.5) * cell_m).astype(np.float32)
    best = np.full((n, n), cap_m * cap_m, dtype=np.float32)
    for dj, di in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)):
        rows, columns = slice(pad + dj, pad + dj + n), slice(pad + di, pad + di + n)
        dx = qx[rows, columns] - at
        dy = qy[rows, columns] - at[:, None]
        dx *= dx
        dy *= dy
        dx += dy
        np.minimum(best, dx, out=best)
    distance = np.minimum(np.sqrt(best).astype(np.float64), cap_m)
    return DistanceField(origin, cell_m, distance, cap_m)
