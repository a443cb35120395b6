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
        field = self.distance_m
        height, width = field.shape
        u = (x - self.origin_m[0]) / self.cell_m - 0.5
        v = (y - self.origin_m[1]) / self.cell_m - 0.5
        inside = (u >= 0.0) & (v >= 0.0) & (u < width - 1) & (v < height - 1)
        all_inside = bool(inside.all())
        if not all_inside:
            u, v = np.where(inside, u, 0.0), np.where(inside, v, 0.0)
        found = bilinear(field, u, v)
        return found if all_inside else np.where(inside, found, self.cap_m)


def bilinear(values: Array, u: Array, v: Array) -> Array:
    """Values (h, w) between its entries, at column u and row v of any shape, inside of it."""
    flat, width = values.ravel(), values.shape[1]
    i, j = u.astype(np.int64), v.astype(np.int64)
    u, v = u - i, v - j
    k = j * width + i
    rest = 1.0 - u
    low = flat.take(k) * rest + flat.take(k + 1) * u
    k += width
    high = flat.take(k) * rest + flat.take(k + 1) * u
    found: Array = low + v * (high - low)
    return found


def distance_field(
    x: Array, y: Array, low: Point, high: Point, cell_m: float, cap_m: float
) -> DistanceField:
    """Distances (m, at most cap_m) to points (n,) in a rectangle between two corners.

    The grid is aligned with multiples of cell_m. The nearest occupied cell is that of the
    Euclidean distance transform; the distance is that to the nearest of the points in it and in
    the nearest cells of the four neighbours, not to its centre.
    """
    width, height = (max(math.ceil((b - a) / cell_m), 2) for a, b in zip(low, high))
    pad = math.ceil(cap_m / cell_m) + 1  # points outside the rectangle count as well
    i0 = math.floor(low[0] / cell_m) - pad
    j0 = math.floor(low[1] / cell_m) - pad
    rows, columns = height + 2 * pad, width + 2 * pad
    i = np.floor(x / cell_m).astype(np.int64) - i0
    j = np.floor(y / cell_m).astype(np.int64) - j0
    inside = (i >= 0) & (j >= 0) & (i < columns) & (j < rows)
    origin = ((i0 + pad) * cell_m, (j0 + pad) * cell_m)
    if not inside.any():
        return DistanceField(origin, cell_m, np.full((height, width), cap_m), cap_m)
    from scipy.ndimage import distance_transform_edt  # loads in 0.1 s, and only here

    cells = j[inside] * columns + i[inside]
    px, py = np.zeros((2, rows * columns), dtype=np.float32)  # relative to the origin: to 1 um
    px[cells], py[cells] = x[inside] - origin[0], y[inside] - origin[1]
    empty = np.ones(rows * columns, dtype=bool)
    empty[cells] = False
    near = distance_transform_edt(
        empty.reshape(rows, columns), return_distances=False, return_indices=True
    )
    index = near[0] * columns + near[1]
    qx, qy = px.take(index), py.take(index)
    at_x = ((np.arange(width) + 0.5) * cell_m).astype(np.float32)
    at_y = ((np.arange(height) + 0.5) * cell_m).astype(np.float32)
    best = np.full((height, width), cap_m * cap_m, dtype=np.float32)
    for dj, di in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)):
        part = (slice(pad + dj, pad + dj + height), slice(pad + di, pad + di + width))
        dx = qx[part] - at_x
        dy = qy[part] - at_y[:, None]
        dx *= dx
        dy *= dy
        dx += dy
        np.minimum(best, dx, out=best)
    distance = np.minimum(np.sqrt(best).astype(np.float64), cap_m)
    return DistanceField(origin, cell_m, distance, cap_m)
