# SPDX-License-Identifier: Apache-2.0
"""Headings in which the robot stood still, and places that it did not leave.

The search predicts paths on a grid of distances; the velocity is checked against the points
themselves. Where the two disagree by millimetres, the robot would stand and choose the same again,
or turn to and fro.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, bearing, distance

Array = np.ndarray

STANDS_NS = 1_000_000_000  # so long the robot stands before the heading counts as blocked
HELD_NS = 10_000_000_000
NEAR_M = 0.15  # a heading is blocked from places so near to where the robot stood
WIDE_RAD = math.radians(25.0)  # to each side of it
PLACE_M, PLACE_NS = 0.3, 8_000_000_000  # a place, and how long the robot may stay there


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


class PlaceCheck:
    """Whether the robot has been at one place for long although it was to drive on.

    In a passage of nearly its own width, what the lidar shows of it changes with every turn, and
    the way through it with that. As Nav2's progress checker, but for the next passage alone.
    """

    def __init__(self) -> None:
        """Start anew."""
        self._since: tuple[int, Point] | None = None
        self._before: Point | None = None

    def reset(self) -> None:
        """The robot is not to drive, or nothing is in its way."""
        self._since = self._before = None

    def stays(self, stamp_ns: int, position: Point) -> float | None:
        """The heading (rad) in which it came to where it has been for PLACE_NS, within PLACE_M.

        None otherwise; the time begins anew then.
        """
        since = self._since
        if since is None or stamp_ns < since[0] or distance(position, since[1]) > PLACE_M:
            self._before = None if since is None else since[1]
            self._since = (stamp_ns, position)
            return None
        if stamp_ns - since[0] < PLACE_NS or self._before is None:
            return None
        self._since = (stamp_ns, position)
        return bearing(self._before, position)
