# SPDX-License-Identifier: Apache-2.0
"""The outline of the occupied cells of a grid, as few long segments."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def outline(occupied: Array, resolution_m: float, origin_m: tuple[float, float]) -> Array:
    """Segments (n, 4) in metres along the outline of the cells that are True.

    occupied: (rows, columns) of bool, the first row at the lowest y; origin_m: the lower left
    corner of the first cell. Edges of cells in one line are one segment. The lines of segments
    lie on the grid, and nothing depends on the order of the cells.
    """
    framed = np.pad(occupied, 1)
    # Between cell k - 1 and k along an axis: an edge where one is occupied and one is not.
    level = (framed[1:] != framed[:-1])[:, 1:-1]
    upright = (framed[:, 1:] != framed[:, :-1])[1:-1]
    row, first, last = _runs(level)
    rows = np.stack([first, row, last, row], axis=1)
    column, low, high = _runs(upright.T)
    columns = np.stack([column, low, column, high], axis=1)
    corners = np.concatenate([rows, columns]).astype(np.float64)
    # Rounded: 0.15 and not 0.15000000000000002 in every bag.
    metres: Array = np.round(corners * resolution_m + np.tile(origin_m, 2), 9)
    return metres


def _runs(lines: Array) -> tuple[Array, Array, Array]:
    """Line number, first cell and the cell after the last, of every run of True in a row."""
    steps = np.diff(np.pad(lines, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    line, first = np.nonzero(steps == 1)
    _, last = np.nonzero(steps == -1)
    return line, first, last
