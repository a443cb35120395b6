# SPDX-License-Identifier: Apache-2.0
"""Poses of the last moments, for the pose at the stamp of a scan that is older or newer."""

from __future__ import annotations

import math
from collections import deque

from ...core.geometry import Pose2D

KEPT_NS = 2_000_000_000
EXTRAPOLATED_NS = 250_000_000  # at most: a scan much newer than odometry has its own refusal


class PoseHistory:
    """Poses by rising stamps; in between they are interpolated, beyond the last extrapolated."""

    def __init__(self) -> None:
        """Start without poses."""
        self._poses: deque[tuple[int, Pose2D]] = deque()

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
