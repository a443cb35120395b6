# SPDX-License-Identifier: Apache-2.0
"""Inputs of the planner node in lockstep: odometry and sectors paired by stamp."""

from __future__ import annotations

from typing import NamedTuple

from ...core.geometry import Pose2D
from ...core.planner_types import Ranges, RefusalReason
from .stamp_pairing import StampPairs


class Inputs(NamedTuple):
    """What one decision is made on."""

    stamp_ns: int
    pose: Pose2D | RefusalReason
    ranges_m: Ranges | RefusalReason
    age_s: float = 0.0


class LockstepInputs:
    """Odom and sectors of one stamp, once both are received; the newest pair also again."""

    def __init__(self) -> None:
        """Start with nothing received."""
        self._pairs: StampPairs[Pose2D | RefusalReason, Ranges | RefusalReason] = StampPairs(
            repeat=True
        )

    def add_odom(
        self, stamp_ns: int, pose: Pose2D | RefusalReason, _now_s: float
    ) -> Inputs | None:
        """Add odom; StampError for a stamp older than the last pair's."""
        pair = self._pairs.add_a(stamp_ns, pose)
        return Inputs(stamp_ns, *pair) if pair else None

    def add_sectors(
        self, stamp_ns: int, ranges_m: Ranges | RefusalReason, _now_s: float
    ) -> Inputs | None:
        """Add sectors; StampError for a stamp older than the last pair's."""
        pair = self._pairs.add_b(stamp_ns, ranges_m)
        return Inputs(stamp_ns, *pair) if pair else None

    def stale(self, _now_s: float, _timeout_s: float) -> Inputs | None:
        """None: in lockstep time does not pass without a message."""
        return None
