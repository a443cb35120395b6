# SPDX-License-Identifier: Apache-2.0
"""Circles that cover the rectangle of a robot: a footprint as scenarios have it."""

from __future__ import annotations

import math

from ...core.errors import ConfigError
from ...simulation.footprint import FARTHEST_M, MOST_CIRCLES
from .imported import DIGITS, rounded

_MOST_ROWS = 4


def rectangle_circles(length_m: float, width_m: float, ahead_m: float = 0.0) -> list[list[float]]:
    """Circles [x, y, radius] (m) around the cells of a grid over the rectangle.

    Its middle is ahead_m before base_link. The cells are as square and as many as the number of
    circles allows: up to 4 : 1 the circles reach at most 0.21 of the shorter side beyond it, a
    square's 0.06. Raises ConfigError for sides that are not above 0.
    """
    for what, side_m in (("length", length_m), ("width", width_m)):
        if not 0.0 < side_m <= FARTHEST_M:
            raise ConfigError(
                f"robot {what}={side_m:g}: out of range; give a number above 0, up to "
                f"{FARTHEST_M:g} m"
            )
    along, across = _cells(length_m, width_m)
    a, b = length_m / along, width_m / across
    # Rounded up, so that the circles cover the corners of their cells.
    radius = (math.floor(0.5 * math.hypot(a, b) * 10**DIGITS) + 2) / 10**DIGITS
    return [
        rounded(ahead_m + (i + 0.5) * a - 0.5 * length_m, (j + 0.5) * b - 0.5 * width_m, radius)
        for i in range(along)
        for j in range(across)
    ]


def _cells(length_m: float, width_m: float) -> tuple[int, int]:
    """Number of cells along and across: rows of square cells, as many rows as allowed."""
    longer = max(length_m, width_m) / min(length_m, width_m)
    rows = [(m, math.ceil(m * longer - 1e-9)) for m in range(1, _MOST_ROWS + 1)]
    fitting = [(m, n) for m, n in rows if m * n <= MOST_CIRCLES] or [(1, MOST_CIRCLES)]
    few, many = fitting[-1]
    return (many, few) if length_m >= width_m else (few, many)
