# SPDX-License-Identifier: Apache-2.0
"""The motion of all obstacles as arrays of segments of uniform motion."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .obstacle_motion import bounce_times, center_at
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
    """Cut the motion of every obstacle in [0, until_s] at its bounces and turns."""
    rows = []
    for index, obstacle in enumerate(scenario.obstacles):
        radius = scenario.enlarged_radius(obstacle)
        times = [0.0, *bounce_times(obstacle, 0.0, until_s, scenario.walls), until_s]
        for t0, t1 in pairwise(times):
            x0, y0 = center_at(obstacle, t0, scenario.walls)
            x1, y1 = center_at(obstacle, t1, scenario.walls)
            vx, vy = (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)
            rows.append((t0, t1, x0, y0, vx, vy, radius, index))
    table = np.array(rows, dtype=np.float64).reshape(-1, 8)
    start, end, x, y, speed_x, speed_y, radii, which = table.T
    return UniformSegments(start, end, x, y, speed_x, speed_y, radii, which.astype(np.intp))
