# SPDX-License-Identifier: Apache-2.0
"""Pose of the robot beside a scan that is older: odometry and the commands since, weighed.

Obstacles are known relative to the pose that came with the scan. An odometry that errs from pose
to pose moves the robot among them by the errors of two poses; its own commands do not.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from ..core.geometry import Point, Pose2D, rotated, wrap_angle

_KEPT_NS = 2_000_000_000
_LEAST_SD_M, _LEAST_SD_RAD = 0.005, 0.005
_SLIP = 0.1  # of a motion: how far a base may differ from its command (standard deviation)


class _Motion(NamedTuple):
    """What was commanded from a stamp on: forwards, left (m) and turn (rad) within a tick."""

    stamp_ns: int
    ahead_m: float
    left_m: float
    turn_rad: float


class DeadReckoning:
    """The last commands, and where they have taken the robot since a stamp."""

    def __init__(self, tick_ns: int) -> None:
        """Start without commands; tick_ns is the time to which each motion belongs."""
        self._tick_ns = tick_ns
        self._motions: deque[_Motion] = deque()

    def command(self, stamp_ns: int, pose: Pose2D, after: Pose2D) -> None:
        """From the stamp on, the robot is driven as from pose to after within a tick."""
        motions = self._motions
        while motions and motions[-1].stamp_ns >= stamp_ns:
            motions.pop()
        while motions and motions[0].stamp_ns < stamp_ns - _KEPT_NS:
            motions.popleft()
        ahead_m, left_m = rotated((after.x - pose.x, after.y - pose.y), -pose.yaw)
        turn_rad = wrap_angle(after.yaw - pose.yaw)
        motions.append(_Motion(stamp_ns, ahead_m, left_m, turn_rad))

    def moved(self, from_ns: int, to_ns: int) -> Pose2D | None:
        """The motion between two stamps, in the robot's frame at the first.

        None where no command is known at from_ns.
        """
        if not self._motions or self._motions[0].stamp_ns > from_ns:
            return None
        x = y = yaw = 0.0
        ends = [motion.stamp_ns for motion in self._motions][1:] + [to_ns]
        for motion, end_ns in zip(self._motions, ends):
            begin_ns, end_ns = max(motion.stamp_ns, from_ns), min(end_ns, to_ns)
            if end_ns <= begin_ns:
                continue
            share = (end_ns - begin_ns) / self._tick_ns
            dx, dy = rotated((share * motion.ahead_m, share * motion.left_m), yaw)
            x, y, yaw = x + dx, y + dy, yaw + share * motion.turn_rad
        return Pose2D(x, y, yaw)

    def pose(
        self,
        sensed: tuple[int, Pose2D],
        now: tuple[int, Pose2D],
        error: tuple[float, float, float],
        variance: tuple[float, float],
    ) -> Pose2D:
        """The pose now as seen from the pose of the scan, both given with their stamps.

        error (x, y, turn) is that of the scan's pose, as far as it is known, and variance (m^2 per
        axis, rad^2) that of single poses. The odometry's own pose where no command is known.
        """
        (sensed_ns, before), (now_ns, present) = sensed, now
        moved = self.moved(sensed_ns, now_ns)
        if moved is None:
            return present
        dx, dy = rotated((moved.x, moved.y), before.yaw)
        moved_m = math.sqrt(dx * dx + dy * dy)
        known = 1.0 if error != (0.0, 0.0, 0.0) else 2.0
        share_m = _share(known * variance[0], _LEAST_SD_M + _SLIP * moved_m)
        share_rad = _share(known * variance[1], _LEAST_SD_RAD + _SLIP * abs(moved.yaw))
        off: Point = (
            before.x + dx - (present.x + error[0]),
            before.y + dy - (present.y + error[1]),
        )
        turn = wrap_angle(before.yaw + moved.yaw - (present.yaw + error[2]))
        return Pose2D(
            present.x + error[0] + share_m * off[0],
            present.y + error[1] + share_m * off[1],
            wrap_angle(present.yaw + error[2] + share_rad * turn),
        )


def _share(odometry_variance: float, command_sd: float) -> float:
    """Weight of the commands beside the odometry, by their variances."""
    return odometry_variance / (odometry_variance + command_sd * command_sd)
