# SPDX-License-Identifier: Apache-2.0
"""Where a robot has been sent: one goal or several in a row. No ROS here."""

from __future__ import annotations

from ...core.geometry import Point, distance


class GoalQueue:
    """The goals still to be reached, in order; number counts what was ordered so far."""

    def __init__(self) -> None:
        """Start with nothing to do."""
        self._points: tuple[Point, ...] = ()
        self._leg = 0
        self.number = 0

    @property
    def goal(self) -> Point | None:
        """Where to go now; None: nowhere."""
        return self._points[self._leg] if self._points else None

    @property
    def leg(self) -> str:
        """Which of how many goals this is, "" without any: '2 of 3'."""
        return f"{self._leg + 1} of {len(self._points)}" if self._points else ""

    def order(self, points: tuple[Point, ...], *, over: bool) -> bool:
        """Go to these instead; False, and nothing changes, where that is being done already.

        over: the present ones are reached, or were given up; then the same may be ordered anew.
        """
        if points == self._points and not over:
            return False
        self._points, self._leg = points, 0
        self.number += 1
        return True

    def pass_by(self, position: Point, tolerance_m: float) -> int:
        """Count how many goals but the last are reached from here, and go on to the next."""
        passed = 0
        while self._leg + 1 < len(self._points):
            if distance(position, self._points[self._leg]) > tolerance_m:
                break
            self._leg += 1
            passed += 1
        return passed

    def begin_anew(self) -> None:
        """Count the same goals as ordered again: whoever drives there has forgotten all."""
        self.number += 1

    def cancel(self) -> Point | None:
        """Go nowhere; return where the robot was on its way to, None: nowhere before either."""
        goal = self.goal
        if goal is not None:
            self._points, self._leg = (), 0
            self.number += 1
        return goal
