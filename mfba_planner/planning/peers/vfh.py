# SPDX-License-Identifier: Apache-2.0
"""Vector field histogram: the free heading of least cost (VFH+, Ulrich 1998)."""

from __future__ import annotations

import math

import numpy as np

from ...core.geometry import Point, bearing
from ...core.planner_types import Observation
from ..base_planner import Move, blocked
from ..mode_transitions import Event
from .circle_planner import CirclePlanner

HEADINGS = 72
ACTIVE_M = 0.8  # circles whose edge is farther away mask nothing: VFH+'s active window
MARGIN_M = 0.3  # added to every radius, as circles move while the robot passes
TO_GOAL, TO_LAST = 5.0, 2.0  # weights of the turn away from the goal and from the last heading


class VectorFieldHistogram(CirclePlanner):
    """Chooses among free headings; a heading between the tangents of a circle is masked.

    Circles count as at rest, as in VFH+, and only within the active window. Cost: TO_GOAL times
    the turn from the goal's heading, plus TO_LAST times the turn from the last heading.
    """

    def forget(self) -> None:
        """Drop the last heading and the tracks."""
        super().forget()
        self._last: float | None = None

    def move(self, obs: Observation, goal: Point) -> Move:
        """Full speed along the cheapest free heading."""
        target = bearing(obs.pose.position, goal)
        rows = self.circle_rows(obs)
        rows = rows[np.hypot(rows[:, 0], rows[:, 1]) - rows[:, 4] <= ACTIVE_M]
        if not rows.size:
            self._last = target
            velocity = self.straight(obs.pose.position, goal, self.params.speed_mps)
            return Move(velocity=velocity, reason="nothing within the active window")
        headings = np.append(np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS), target)
        away = np.hypot(rows[:, 0], rows[:, 1])
        directions = np.arctan2(rows[:, 1], rows[:, 0])
        half = np.arcsin(np.minimum((rows[:, 4] + MARGIN_M) / np.maximum(away, 1e-9), 1.0))
        off = np.abs(_turn(headings[:, None], directions))
        masked = (off < half).any(axis=1)
        if masked.all():
            return blocked("every heading is masked")
        last = target if self._last is None else self._last
        cost = TO_GOAL * np.abs(_turn(headings, target)) + TO_LAST * np.abs(_turn(headings, last))
        cost[masked] = np.inf
        heading = float(headings[int(cost.argmin())])
        self._last = heading
        speed = self.params.speed_mps
        return Move(
            velocity=(speed * math.cos(heading), speed * math.sin(heading)),
            reason=f"{int(masked.sum())} of {masked.size} headings masked",
            event=Event.OBSTACLE,
        )


def _turn(a: np.ndarray, b: np.ndarray | float) -> np.ndarray:
    """Signed smallest angle from b to a."""
    turn: np.ndarray = np.remainder(a - b + math.pi, 2.0 * math.pi) - math.pi
    return turn
