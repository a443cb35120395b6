# SPDX-License-Identifier: Apache-2.0
"""The planner's goals: one, or several to visit one after another. No ROS here."""

from __future__ import annotations

from ...core.geometry import Point, distance


class GoalQueue:
    """The goals to visit, first to last; goal_id counts the requests so far."""

    def __init__(self) -> None:
        """Start without a goal."""
        self._points: tuple[Point, ...] = ()
        self._index = 0
        self.goal_id = 0

    @property
    def goal(self) -> Point | None:
        """The present goal, None without any."""
        return self._points[self._index] if self._points else None

    @property
    def goal_index(self) -> str:
        """Which of how many goals the present one is, "" without any: '2 of 3'."""
        return f"{self._index + 1} of {len(self._points)}" if self._points else ""

    @property
    def fields(self) -> dict[str, str]:
        """What planner/decision reports of the goals."""
        return {"goal_id": str(self.goal_id), "goal_index": self.goal_index}

    def set_goals(self, points: tuple[Point, ...], *, finished: bool) -> bool:
        """Replace the goals; False, and nothing changes, for the same goals again.

        finished: the present goals are reached or given up; then the same ones count as new.
        """
        if points == self._points and not finished:
            return False
        self._points, self._index = points, 0
        self.goal_id += 1
        return True

    def advance(self, position: Point, tolerance_m: float) -> int:
        """Skip goals that are reached at this position, never the last; return how many."""
        reached = 0
        while self._index + 1 < len(self._points):
            if distance(position, self._points[self._index]) > tolerance_m:
                break
            self._index += 1
            reached += 1
        return reached

    def renew(self) -> None:
        """Count the same goals as requested again: the planner was reset."""
        self.goal_id += 1

    def cancel(self) -> Point | None:
        """Drop all goals; return the present one, None if there was none."""
        goal = self.goal
        if goal is not None:
            self._points, self._index = (), 0
            self.goal_id += 1
        return goal
