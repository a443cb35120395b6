# SPDX-License-Identifier: Apache-2.0
"""Contact between a disc and obstacles, continuous in time."""

from __future__ import annotations

import math

from ..core.geometry import Point, closest_approach
from .obstacle_motion import Obstacle, pieces
from .scenario import Scenario


def step_clearances(
    scenario: Scenario, t0_s: float, t1_s: float, start: Point, end: Point
) -> list[float]:
    """Smallest gap (m) to each obstacle while the disc moves uniformly from start to end.

    Continuous in time, and exact through bounces, turns and knots: between two of them both
    motions are uniform. Negative means contact; inf, that the obstacle is absent.
    """
    return [
        clearance(scenario, obstacle, t0_s, t1_s, start, end) for obstacle in scenario.obstacles
    ]


def clearance(
    scenario: Scenario,
    obstacle: Obstacle,
    t0_s: float,
    t1_s: float,
    start: Point,
    end: Point,
    radius_m: float | None = None,
) -> float:
    """step_clearances, for one obstacle; radius_m of the disc, None: robot_radius_m."""
    smallest = math.inf
    duration = t1_s - t0_s
    for ta, tb, here, there in pieces(obstacle, t0_s, t1_s, scenario.walls):
        sa, sb = ((t - t0_s) / duration if duration else 0.0 for t in (ta, tb))
        gap = closest_approach(_between(start, end, sa), _between(start, end, sb), here, there)
        smallest = min(smallest, gap)
    own_m = scenario.robot_radius_m if radius_m is None else radius_m
    return smallest - (obstacle.radius_m + own_m)


def _between(a: Point, b: Point, s: float) -> Point:
    return (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))
