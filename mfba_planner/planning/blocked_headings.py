# SPDX-License-Identifier: Apache-2.0
"""Headings in which the robot stood still although the search chose them.

The search predicts paths on a grid of distances; the velocity is checked against the points
themselves. Where the two disagree by millimetres, the robot would stand and choose the same again.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, distance

Array = np.ndarray

STANDS_NS = 1_000_000_000  # so long the robot stands before the heading counts as blocked
HELD_NS = 10_000_000_000
NEAR_M = 0.15  # a heading is blocked from places so near to where the robot stood
WIDE_RAD = math.radians(25.0)  # to each side of it


class BlockedHeadings:
    """Places and headings at which the robot stood still. Positions are in the map's frame."""

    def __init__(self) -> None:
        """Start with none."""
        self._since_ns: int | None = None
        self._blocked: list[tuple[int, Point, float]] = []

    def drives(self) -> None:
        """The robot does not stand at this decision."""
        self._since_ns = None

    def stands(self, stamp_ns: int, position: Point, heading_rad: float) -> bool:
        """The robot stands and is to drive in a heading; whether that is blocked from now on."""
        if self._since_ns is None or stamp_ns < self._since_ns:
            self._since_ns = stamp_ns
        if stamp_ns - self._since_ns < STANDS_NS:
            return False
        self._since_ns = None
        self._blocked.append((stamp_ns, position, heading_rad))
        return True

    def open(self, stamp_ns: int, position: Point, headings_rad: Array) -> Array | None:
        """Whether each heading (n,) may be driven from a position; None if all may."""
        self._blocked = [b for b in self._blocked if 0 <= stamp_ns - b[0] < HELD_NS]
        near = [b[2] for b in self._blocked if distance(b[1], position) < NEAR_M]
        if not near:
            return None
        apart = np.cos(headings_rad[:, None] - np.array(near))
        allowed: Array = (apart < math.cos(WIDE_RAD)).all(axis=1)
        return allowed
