# SPDX-License-Identifier: Apache-2.0
"""The task of every generated world: the paper's trip, and points relative to it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ...core.geometry import Point, distance
from ...simulation.obstacle_motion import Obstacle, Walls
from ...simulation.scenario import Scenario

START_M: Point = (0.0, 0.0)
GOAL_M: Point = (12.0, 12.0)
ROBOT_RADIUS_M = 0.3
OBSTACLE_RADIUS_M = 0.3
ROOM = Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """The straight trip without obstacles: the moving target of adversarial worlds."""

    speed_mps: float

    @property
    def length_m(self) -> float:
        """Straight distance from start to goal."""
        return distance(START_M, GOAL_M)

    @property
    def time_s(self) -> float:
        """Time at which the goal is reached."""
        return self.length_m / self.speed_mps

    def at(self, t_s: float) -> Point:
        """Position at time t; it ends at the goal."""
        return self.beside(min(t_s * self.speed_mps, self.length_m), 0.0)

    def beside(self, along_m: float, across_m: float) -> Point:
        """The point along_m along the trip and across_m to its left."""
        dx, dy = self.unit(0.0)
        x, y = START_M
        return (x + along_m * dx - across_m * dy, y + along_m * dy + across_m * dx)

    def heading(self, offset_rad: float) -> float:
        """A heading, relative to that of the trip."""
        return math.atan2(GOAL_M[1] - START_M[1], GOAL_M[0] - START_M[0]) + offset_rad

    def unit(self, offset_rad: float) -> Point:
        """The unit vector of heading()."""
        return (math.cos(self.heading(offset_rad)), math.sin(self.heading(offset_rad)))


def leaves_room(center_m: Point, radius_m: float, margin_m: float) -> bool:
    """Whether neither start nor goal is within margin of an obstacle's enlarged edge."""
    free = radius_m + ROBOT_RADIUS_M + margin_m
    return distance(center_m, START_M) >= free and distance(center_m, GOAL_M) >= free


def scenario(
    name: str, obstacles: Iterable[Obstacle], walls: Walls | None = None, description: str = ""
) -> Scenario:
    """A Scenario of this trip."""
    return Scenario(
        name=name,
        start_m=START_M,
        goal_m=GOAL_M,
        robot_radius_m=ROBOT_RADIUS_M,
        obstacles=tuple(obstacles),
        walls=walls,
        description=description,
    )
