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
    the nearest cells of the four neighbours, not to its centre. Of the points in a cell one
    counts, so a distance may be too long by the cell's diagonal.
    """
    width, height = (max(math.ceil((b - a) / cell_m), 2) for a, b in zip(low, high))
    pad = math.ceil(cap_m / cell_m) + 1  # points outside the rectangle count as well
    left, bottom = math.floor(low[0] / cell_m), math.floor(low[1] / cell_m)
    i = np.floor(x / cell_m).astype(np.int64) - left
    j = np.floor(y / cell_m).astype(np.int64) - bottom
    inside = (i >= -pad) & (j >= -pad) & (i < width + pad) & (j < height + pad)
    origin, distance_m = (left * cell_m, bottom * cell_m), np.full((height, width), cap_m)
    i, j = i[inside], j[inside]
    if i.size:  # farther from all points than the cap, nothing is to be computed
        first_i, end_i = max(int(i.min()) - pad, 0), min(int(i.max()) + pad + 1, width)
        first_j, end_j = max(int(j.min()) - pad, 0), min(int(j.max()) + pad + 1, height)
        part = distance_m[first_j:end_j, first_i:end_i]
        corner = (origin[0] + first_i * cell_m, origin[1] + first_j * cell_m)
        at = (x[inside] - corner[0], y[inside] - corner[1])
        _fill(part, at, (i - first_i, j - first_j), pad, cell_m)
    return DistanceField(origin, cell_m, distance_m, cap_m)


def _fill(
    distance_m: Array, at: tuple[Array, Array], cells: tuple[Array, Array], pad: int, cell_m: float
) -> None:
    """Lower distances (h, w) to those to points, given from its corner with their cells."""
    from scipy.ndimage import distance_transform_edt  # loads in 0.1 s, and only here

    height, width = distance_m.shape
    rows, columns = height + 2 * pad, width + 2 * pad
    cell = (cells[1] + pad) * columns + cells[0] + pad
    px, py = np.zeros((2, rows * columns), dtype=np.float32)  # relative to the corner: to 1 um
    px[cell], py[cell] = at
    empty = np.ones(rows * columns, dtype=bool)
    empty[cell] = False
    near = distance_transform_edt(
        empty.reshape(rows, columns), return_distances=False, return_indices=True
    )
    index = near[0] * columns + near[1]
    qx, qy = px.take(index), py.take(index)
    at_x = ((np.arange(width) + 0.5) * cell_m).astype(np.float32)
    at_y = ((np.arange(height) + 0.5) * cell_m).astype(np.float32)
    best = np.full((height, width), np.inf, dtype=np.float32)
    for dj, di in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)):
        part = (slice(pad + dj, pad + dj + height), slice(pad + di, pad + di + width))
        dx = qx[part] - at_x
        dy = qy[part] - at_y[:, None]
        dx *= dx
        dy *= dy
        dx += dy
        np.minimum(best, dx, out=best)
    np.minimum(distance_m, np.sqrt(best), out=distance_m)
