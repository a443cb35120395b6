# SPDX-License-Identifier: Apache-2.0
"""The straight line to the goal, ignoring obstacles: the baseline."""

from __future__ import annotations

from ...core.geometry import Point
from ...core.planner_types import Observation
from ..base_planner import BasePlanner, Move


class Straight(BasePlanner):
    """Drives straight to the goal at full speed."""

    reads_sectors = False
    inputs = ()

    def move(self, obs: Observation, goal: Point) -> Move:
        """Straight to the goal."""
        velocity = self.straight(obs.pose.position, goal, self.params.speed_mps)
        return Move(velocity=velocity, reason="straight to the goal")
