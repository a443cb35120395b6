# SPDX-License-Identifier: Apache-2.0
"""Results of the oracle: certificate, waypoints, solution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from ...core.geometry import Point


class Certificate(Enum):
    """Whether a world can be crossed by a robot of one speed."""

    FEASIBLE = "feasible"  # a trajectory at constant speed was found and checked independently
    INFEASIBLE = "infeasible"  # proven on a time grid, also for slowing down and waiting
    UNDECIDED = "undecided"


class Waypoint(NamedTuple):
    """A time and the robot's position, in seconds and metres."""

    t_s: float
    x: float
    y: float

    @property
    def point(self) -> Point:
        """(x, y) in metres."""
        return (self.x, self.y)


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """The shortest trajectory found at constant speed; length inf and no waypoints without one.

    length_m is an upper bound of the true optimum, straight_m a lower bound. Of a robot with a
    footprint trajectory and clearance are those of the disc of robot_radius_m.
    """

    certificate: Certificate
    speed_mps: float
    straight_m: float
    waypoints: tuple[Waypoint, ...] = ()
    clearance_m: float = math.inf  # smallest, by the independent check
    reason: str = ""

    @property
    def length_m(self) -> float:
        """Length of the trajectory in metres."""
        return self.waypoints[-1].t_s * self.speed_mps if self.waypoints else math.inf

    @property
    def detour(self) -> float:
        """Length / straight line: 1 for a world that needs no avoidance at all."""
        return self.length_m / self.straight_m
