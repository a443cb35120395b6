# SPDX-License-Identifier: Apache-2.0
"""Whether obstacles move, from sectors alone: their ranges change while the robot rests."""

from __future__ import annotations

import math

from ..core.geometry import Point, distance
from ..core.planner_types import NANO, Observation, Ranges

_REST_M = 0.01  # a robot that has moved less has rested
_CHANGE_M = 0.05  # of a range; less is the noise of a lidar
_KEPT_S = 2.0  # time for which obstacles count as moving then


class SectorChanges:
    """Compares the sectors of an enclosed robot with those when it came to rest."""

    def __init__(self) -> None:
        """Start without sectors."""
        self._at_rest: tuple[Point, Ranges] | None = None
        self._moving_until_ns = 0

    def not_enclosed(self) -> None:
        """The robot is not enclosed in this tick."""
        self._at_rest = None

    def at_rest(self, obs: Observation) -> bool:
        """Whether what encloses the robot in a tick is at rest.

        With circles or a scan it is known what moves. Where a sector reads 0, there is no room
        to evade.
        """
        if obs.circles is not None or obs.scan is not None:
            return True
        moving = self._moving(obs.stamp_ns, obs.pose.position, obs.ranges_m)
        return not moving or min(obs.ranges_m) == 0.0

    def _moving(self, stamp_ns: int, position: Point, ranges_m: Ranges) -> bool:
        """Take the sectors of a tick; whether obstacles moved in the last seconds."""
        if self._at_rest is None or distance(position, self._at_rest[0]) > _REST_M:
            self._at_rest = position, ranges_m
        elif _differ(self._at_rest[1], ranges_m):
            self._moving_until_ns = stamp_ns + round(_KEPT_S / NANO)
            self._at_rest = position, ranges_m
        return stamp_ns < self._moving_until_ns


def _differ(before: Ranges, now: Ranges) -> bool:
    """Whether a range has changed; a sector at the edge of the sensing range says nothing."""
    if len(before) != len(now):
        return True
    return any(_CHANGE_M < abs(a - b) < math.inf for a, b in zip(before, now))
