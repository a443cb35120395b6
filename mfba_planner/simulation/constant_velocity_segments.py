# SPDX-License-Identifier: Apache-2.0
"""The motion of all obstacles as arrays of segments of uniform motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .obstacle_motion import pieces
from .scenario import Scenario


class UniformSegments(NamedTuple):
    """m segments of uniform motion; every field is an array of m numbers."""

    t0: np.ndarray  # s, start of the segment
    t1: np.ndarray  # s, its end
    x: np.ndarray  # m, centre at t0
    y: np.ndarray
    vx: np.ndarray  # m/s
    vy: np.ndarray
    radius: np.ndarray  # m, enlarged
    obstacle: np.ndarray  # index into Scenario.obstacles

    def select(self, obstacles: list[int]) -> UniformSegments:
        """The segments of some obstacles only."""
        keep = np.isin(self.obstacle, obstacles)
        return UniformSegments(*(column[keep] for column in self))


def uniform_segments(scenario: Scenario, until_s: float) -> UniformSegments:
    """Cut the motion of every obstacle in [0, until_s] at its bounces, turns and knots.

    An obstacle has no segment while it is absent.
    """
    rows = []
    for index, obstacle in enumerate(scenario.obstacles):
        radius = scenario.enlarged_radius(obstacle)
        for t0, t1, (x0, y0), (x1, y1) in pieces(obstacle, 0.0, until_s, scenario.walls):
            if t0 == t1:
                continue
            vx, vy = (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)
            rows.append((t0, t1, x0, y0, vx, vy, radius, index))
    table = np.array(rows, dtype=np.float64).reshape(-1, 8)
    start, end, x, y, speed_x, speed_y, radii, which = table.T
    return UniformSegments(start, end, x, y, speed_x, speed_y, radii, which.astype(np.intp))
