# SPDX-License-Identifier: Apache-2.0
"""Base class of the peers that avoid circles: given, or tracked in the scan of a lidar."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.planner_types import Circle, Observation
from ..base_planner import BasePlanner
from ..circles_from_observation import CirclesFromObservation, circle_rows


class CirclePlanner(BasePlanner):
    """A planner whose move() asks for circles; it does not read sectors."""

    reads_sectors = False
    inputs = ("circles", "scan")

    def forget(self) -> None:
        """Drop the tracks."""
        self._circles = CirclesFromObservation(self.params)

    def circles(self, obs: Observation) -> Sequence[Circle]:
        """Enlarged circles at the observation's stamp; once per observation."""
        return self._circles.update(obs)

    def circle_rows(self, obs: Observation) -> np.ndarray:
        """circles() as rows (x, y, vx, vy, radius) relative to the robot, (n, 5)."""
        return circle_rows(self.circles(obs), obs.pose.position)
