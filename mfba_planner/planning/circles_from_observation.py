# SPDX-License-Identifier: Apache-2.0
"""Circles around the robot for planners that need them: given ones, or tracked in the scan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.geometry import Point
from ..core.planner_types import NANO, Circle, Observation
from ..perception.obstacle_tracker import Tracker
from .planner_params import PlannerParams
from .trajectory_cost import predicted_circles


class CirclesFromObservation:
    """The circles of successive observations of one robot, at the stamp of each.

    Circles that the observation gives are taken as they are. Otherwise they are those that
    perception.obstacle_tracker, the tracker of the predictive planner, finds in the scan.
    """

    def __init__(self, params: PlannerParams) -> None:
        """Start without tracks."""
        self._radius_m = params.robot_radius_m
        self._tracker = Tracker()

    def update(self, obs: Observation) -> Sequence[Circle]:
        """Enlarged circles in the odom frame, predicted to obs.pose_ns; () for neither input."""
        stamp_ns, pose = obs.sensed or (obs.stamp_ns, obs.pose)
        if obs.circles is not None:
            age_s = (obs.pose_ns - stamp_ns) * NANO
            return predicted_circles(obs.circles, age_s) if age_s else obs.circles
        if obs.scan is None:
            return ()
        self._tracker.update(stamp_ns, obs.scan.taken_from(pose), obs.scan)
        return self._tracker.circles(obs.pose_ns, self._radius_m)


def circle_rows(circles: Sequence[Circle], position: Point) -> np.ndarray:
    """Rows (x, y, vx, vy, radius) relative to a position; (n, 5), n may be 0."""
    px, py = position
    rows = [(c.center_m[0] - px, c.center_m[1] - py, *c.velocity_mps, c.radius_m) for c in circles]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)
