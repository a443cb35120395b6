# SPDX-License-Identifier: Apache-2.0
"""Obstacles around the robot as an array, from known circles or from a scan."""

from __future__ import annotations

import numpy as np

from ..core.planner_types import ROBOT_RADIUS_M, Observation


def circle_rows(obs: Observation) -> np.ndarray:
    """Rows (x, y, vx, vy, radius) around the robot, enlarged by it; (n, 5), n may be 0.

    Known circles if given; otherwise each return of the scan, in a frame aligned with odom, as a
    point at rest enlarged by the default robot radius.
    """
    px, py = obs.pose.position
    if obs.circles is not None:
        rows = [
            (c.center_m[0] - px, c.center_m[1] - py, *c.velocity_mps, c.radius_m)
            for c in obs.circles
        ]
        return np.array(rows, dtype=np.float64).reshape(-1, 5)
    if obs.scan is None:
        return np.empty((0, 5))
    ranges = np.asarray(obs.scan.ranges_m, dtype=np.float64)
    hits = np.flatnonzero(np.isfinite(ranges))
    angles = obs.scan.angle_min_rad + hits * obs.scan.angle_increment_rad
    found = np.zeros((hits.size, 5))
    found[:, 0] = ranges[hits] * np.cos(angles)
    found[:, 1] = ranges[hits] * np.sin(angles)
    found[:, 4] = ROBOT_RADIUS_M
    return found
