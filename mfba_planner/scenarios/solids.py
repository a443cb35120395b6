# SPDX-License-Identifier: Apache-2.0
"""Polygons and boxes of scenario files: checked, their outlines, and what lies inside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import Point
from ..core.segments import Segment, Segments

MOST_CORNERS = 1000  # of one polygon: the check for crossings compares all pairs of edges


class Solid(Protocol):
    """What the robot cannot be inside of; its outline is walls."""

    @property
    def refusal(self) -> str:
        """Why a point is refused that is inside, and the remedy."""
        ...

    def covers(self, point: Point) -> bool:
        """Whether a point is inside."""
        ...


class Polygon:
    """A closed polygon without crossings, named as in messages."""

    def __init__(self, name: str, corners: Sequence[Point]) -> None:
        """Raise ConfigError unless the corners make a polygon; the first may stand at the end."""
        if len(corners) > 1 and corners[0] == corners[-1]:
            corners = corners[:-1]
        self.name, self.corners = name, tuple(corners)
        if len(corners) < 3:
            raise ConfigError(f"{name}: {len(corners)} corners; give three or more")
        if len(corners) > MOST_CORNERS:
            raise ConfigError(
                f"{name}: {len(corners)} corners, more than {MOST_CORNERS}; simplify or split it"
            )
        self._edges = Segments.of(self.outline)
        self._check()

    @property
    def refusal(self) -> str:
        """As Solid.refusal."""
        return f"inside {self.name}; move it out (the walls of a room are segments_m)"

    @property
    def outline(self) -> list[Segment]:
        """Its edges, in the order of the corners."""
        ends = (*self.corners[1:], self.corners[0])
        return [(*a, *b) for a, b in zip(self.corners, ends)]

    def covers(self, point: Point) -> bool:
        """Whether a point is inside (even-odd rule)."""
        x0, y0, dx, dy = self._edges
        y = point[1]
        spans = (y0 <= y) != (y0 + dy <= y)
        with np.errstate(divide="ignore", invalid="ignore"):
            crosses = spans & (point[0] < x0 + (y - y0) / dy * dx)
        return bool(crosses.sum() % 2)

    def _check(self) -> None:
        """Refuse edges of length 0, edges that turn back on themselves, and crossings."""
        x, y, dx, dy = self._edges
        count = len(x)
        for number in np.flatnonzero((dx == 0.0) & (dy == 0.0)).tolist():
            raise ConfigError(f"{self.name}: corner {number + 1} given twice running; remove one")
        after_x, after_y = np.roll(dx, -1), np.roll(dy, -1)
        back = (dx * after_y == dy * after_x) & (dx * after_x + dy * after_y < 0.0)
        for number in np.flatnonzero(back).tolist():
            raise ConfigError(
                f"{self.name}: turns back on itself at corner {(number + 1) % count + 1}; "
                "remove that corner"
            )
        met = self._edges.swept_distances(x[:, None], y[:, None], dx[:, None], dy[:, None]) == 0.0
        apart = np.abs(np.arange(count)[:, None] - np.arange(count))
        met &= (apart > 1) & (apart < count - 1)
        for a, b in np.argwhere(met).tolist():
            raise ConfigError(
                f"{self.name}: edges {a + 1} and {b + 1} cross or touch; "
                "sort the corners along the outline, or split the polygon"
            )


def box(name: str, center_m: Point, size_m: Point, yaw_rad: float) -> Polygon:
    """A rectangle with its length along yaw, as a polygon."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    half_x, half_y = 0.5 * size_m[0], 0.5 * size_m[1]
    corners = [(half_x, half_y), (-half_x, half_y), (-half_x, -half_y), (half_x, -half_y)]
    return Polygon(
        name, [(center_m[0] + c * x - s * y, center_m[1] + s * x + c * y) for x, y in corners]
    )
