# SPDX-License-Identifier: Apache-2.0
"""The straight line to the goal, whatever is in the way: what doing nothing is worth."""

from __future__ import annotations

from ...core.geometry import Point
from ...core.types import Observation
from ..base_planner import BasePlanner, Move


class Straight(BasePlanner):
    """Drives at the goal at full speed."""

    reads_sectors = False

    def move(self, obs: Observation, goal: Point) -> Move:
        """Straight on, never looking."""
        velocity = self.straight(obs.pose.position, goal, self.params.speed_mps)
        return Move(velocity=velocity, reason="straight to the goal")
