# SPDX-License-Identifier: Apache-2.0
"""The eikonal equation |grad D| F = 1 on a grid: F from distances, D, and the way down it."""

from __future__ import annotations

import numpy as np

from ..core.geometry import Point
from ..core.interrupts import interrupts_held

Array = np.ndarray

TOUCH_M = 0.01  # nearer than so much beyond the radius counts as closed
CLOSED = 0.02  # F there; not 0, so that the distance to go stays finite
_SLOWEST, _ROOM_M = 0.5, 0.3  # F beside what stands, and from where it is 1


def cell_of(
    point: Point, origin_m: Point, cell_m: float, shape: tuple[int, ...]
) -> tuple[int, int]:
    """Row and column of the cell of a point; of one outside the grid the nearest."""
    (height, width), (x, y) = shape, origin_m
    row = min(max(int((point[1] - y) / cell_m), 0), height - 1)
    return row, min(max(int((point[0] - x) / cell_m), 0), width - 1)


def march(speed: Array, end: tuple[int, int], cell_m: float) -> Array:
    """D (m) to the cell at (row, column) end, by fast marching."""
    import eikonalfm  # only here: most runs in the open do not need it

    # It handles SIGINT by a C++ exception, which may end the process: a robot would drive on.
    with interrupts_held():
        to_go: Array = eikonalfm.fast_marching(speed, end, (cell_m, cell_m), 2)
    return to_go


def speed_share(clearance_m: Array, radius_m: float) -> Array:
    """Share of the full speed at distances from what stands."""
    room = (clearance_m - radius_m - TOUCH_M) / _ROOM_M
    speed = _SLOWEST + (1.0 - _SLOWEST) * np.minimum(room, 1.0)
    speed[room < 0.0] = CLOSED
    return speed


def downhill(to_go: Array) -> Array:
    """Unit vectors (complex) down the distance to go; 0 at its least.

    By differences to the lower neighbours alone, as in the scheme that computes it: central ones
    would point across a narrow door, at what closes it.
    """
    padded = np.pad(to_go, 1, constant_values=np.inf)
    left, right = to_go - padded[1:-1, :-2], to_go - padded[1:-1, 2:]
    below, above = to_go - padded[:-2, 1:-1], to_go - padded[2:, 1:-1]
    step = np.maximum(np.maximum(left, right), 0.0) * np.where(right > left, 1.0, -1.0) + 1j * (
        np.maximum(np.maximum(below, above), 0.0) * np.where(above > below, 1.0, -1.0)
    )
    found: Array = step / (np.abs(step) + 1e-12)
    return found
