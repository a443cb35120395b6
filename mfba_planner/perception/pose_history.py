# SPDX-License-Identifier: Apache-2.0
"""Poses of the last moments, for the pose at the stamp of a scan that is older or newer."""

from __future__ import annotations

import math
from collections import deque

from ..core.geometry import Pose2D, relative_pose, rotated

SECOND_NS = 1_000_000_000
KEPT_NS = 2 * SECOND_NS
EXTRAPOLATED_NS = 250_000_000  # at most: a scan much newer than odometry has its own refusal


class PoseHistory:
    """Poses by rising stamps; in between they are interpolated, beyond the last extrapolated."""

    def __init__(self) -> None:
        """Start without poses."""
        self._poses: deque[tuple[int, Pose2D]] = deque()

    @property
    def newest_ns(self) -> int:
        """The stamp of the last pose; -1 without poses."""
        return self._poses[-1][0] if self._poses else -1

    def add(self, stamp_ns: int, pose: Pose2D) -> None:
        """Add a pose; one with the stamp of the last replaces it."""
        if self._poses and self._poses[-1][0] >= stamp_ns:
            self._poses.pop()
        self._poses.append((stamp_ns, pose))
        while self._poses[0][0] < stamp_ns - KEPT_NS:
            self._poses.popleft()

    def at(self, stamp_ns: int) -> Pose2D | None:
        """The pose at a stamp; None without poses.

        Before the first pose it is the first. Beyond the last the motion between the last two
        goes on, for a quarter of a second at most.
        """
        if not self._poses:
            return None
        before = after = self._poses[-1]
        for item in reversed(self._poses):
            before = item
            if item[0] <= stamp_ns:
                break
            after = item
        if before is after:
            if stamp_ns <= after[0] or len(self._poses) < 2:
                return after[1]
            before, stamp_ns = self._poses[-2], min(stamp_ns, after[0] + EXTRAPOLATED_NS)
        (t0, p0), (t1, p1) = before, after
        if stamp_ns <= t0:
            return p0
        share = (stamp_ns - t0) / (t1 - t0)
        turned = math.remainder(p1.yaw - p0.yaw, 2.0 * math.pi)
        return Pose2D(
            p0.x + share * (p1.x - p0.x),
            p0.y + share * (p1.y - p0.y),
            math.remainder(p0.yaw + share * turned, 2.0 * math.pi),
        )

    def motion(
        self, stamp_ns: int, now_ns: int, duration_ns: int
    ) -> tuple[Pose2D, tuple[float, float, float]]:
        """The pose at a stamp seen from that at another, and the velocity (vx, vy, wz) before it.

        The velocity is the mean of the time duration_ns before the stamp, in the robot's frame; 0
        for a duration of 0. At rest at the origin without poses.
        """
        at, now = self.at(stamp_ns), self.at(now_ns)
        still = (0.0, 0.0, 0.0)
        if at is None or now is None:
            return Pose2D(0.0, 0.0), still
        moved = relative_pose(at, now)
        before = self.at(stamp_ns - duration_ns)
        if not duration_ns or before is None:
            return moved, still
        per_s = SECOND_NS / duration_ns
        turned = math.remainder(at.yaw - before.yaw, 2.0 * math.pi)
        vx, vy = rotated((at.x - before.x, at.y - before.y), -at.yaw)
        return moved, (per_s * vx, per_s * vy, per_s * turned)
