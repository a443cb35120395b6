# SPDX-License-Identifier: Apache-2.0
"""Straight wall segments as arrays: distances from points and from points in uniform motion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .geometry import Point

Segment = tuple[float, float, float, float]  # x0, y0, x1, y1 of its two ends, m
Array = np.ndarray


class Segments(NamedTuple):
    """n segments from (x, y) to (x + dx, y + dy), metres; every field is an array of n numbers."""

    x: Array
    y: Array
    dx: Array
    dy: Array

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> Segments:
        """The arrays of some segments."""
        x0, y0, x1, y1 = np.array(segments, dtype=np.float64).reshape(-1, 4).T
        return cls(x0, y0, x1 - x0, y1 - y0)

    def select(self, which: Array) -> Segments:
        """Some of the segments, by index or by a mask."""
        return Segments(*(column[which] for column in self))

    def near(self, position: Point, reach_m: float) -> Segments:
        """The segments that come within reach of a point; none of them is missing.

        May hold others too. A position that is not finite counts as near to all.
        """
        mx, my = self.x + 0.5 * self.dx - position[0], self.y + 0.5 * self.dy - position[1]
        far = 0.5 * np.sqrt(self.dx * self.dx + self.dy * self.dy) + (reach_m + 1e-6)
        return self.select(~(mx * mx + my * my > far * far))

    def distances(self, x: Array | float, y: Array | float) -> Array:
        """Distance (m) of points to every segment; points broadcast against the segments."""
        px, py = x - self.x, y - self.y
        return _length(*_from_nearest(px, py, self.dx, self.dy))

    def swept_distances(self, x: Array, y: Array, ux: Array, uy: Array) -> Array:
        """Smallest distance (m) of points that move from (x, y) by (ux, uy), to every segment.

        Closed form: 0 where the path crosses the segment, else one of the four ends is nearest.
        """
        px, py = self.x - x, self.y - y  # from the start of the path to that of the segment
        qx, qy = px + self.dx, py + self.dy
        nearest = np.minimum(
            _length(*_from_nearest(px, py, ux, uy)), _length(*_from_nearest(qx, qy, ux, uy))
        )
        for ax, ay in ((-px, -py), (ux - px, uy - py)):
            nearest = np.minimum(nearest, _length(*_from_nearest(ax, ay, self.dx, self.dy)))
        sides = (px * uy - py * ux) * (qx * uy - qy * ux)
        own_sides = (self.dx * py - self.dy * px) * (self.dx * (py - uy) - self.dy * (px - ux))
        return np.where((sides < 0.0) & (own_sides < 0.0), 0.0, nearest)


def _from_nearest(px: Array, py: Array, dx: Array, dy: Array) -> tuple[Array, Array]:
    """From the nearest point of the segment 0 to (dx, dy), to (px, py); a point if it is short."""
    square = dx * dx + dy * dy
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = (px * dx + py * dy) / square
    s = np.minimum(1.0, np.where(s > 0.0, s, 0.0))  # 0/0 of a path at rest: 0
    return px - s * dx, py - s * dy


def _length(x: Array, y: Array) -> Array:
    square: Array = x * x + y * y
    return np.sqrt(square)


@lru_cache(maxsize=64)
def segments_of(segments: tuple[Segment, ...]) -> Segments:
    """Segments.of(), kept for the next call: a scenario is asked for them in many places."""
    return Segments.of(segments)
