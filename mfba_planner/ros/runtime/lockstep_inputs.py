# SPDX-License-Identifier: Apache-2.0
"""Inputs of the planner node in lockstep: odometry and sectors paired by stamp."""

from __future__ import annotations

from typing import NamedTuple

from ...core.geometry import Pose2D
from ...core.planner_types import Ranges, RefusalReason
from ...recording.scan_parts import MountedScan
from .stamp_pairing import StampPairs


class Inputs(NamedTuple):
    """What one decision is made on; scan is the one of the sectors, for a planner that reads it.

    The stamp is that of sectors and scan. pose_stamp_ns is that of the pose if it is later, and
    sensed then the scan's stamp and the pose at it, as in Observation.
    """

    stamp_ns: int
    pose: Pose2D | RefusalReason
    ranges_m: Ranges | RefusalReason
    age_s: float = 0.0
    scan: MountedScan | None = None
    pose_stamp_ns: int | None = None
    sensed: tuple[int, Pose2D] | None = None


class LockstepInputs:
    """Odom and sectors of one stamp, once both are received; the newest pair also again."""

    def __init__(self) -> None:
        """Start with nothing received."""
        self._pairs: StampPairs[
            Pose2D | RefusalReason, tuple[Ranges | RefusalReason, MountedScan | None]
        ] = StampPairs(repeat=True)

    def add_odom(
        self, stamp_ns: int, pose: Pose2D | RefusalReason, _now_s: float
    ) -> Inputs | None:
        """Add odom; StampError for a stamp older than the last pair's."""
        return _inputs(stamp_ns, self._pairs.add_a(stamp_ns, pose))

    def add_sectors(
        self,
        stamp_ns: int,
        ranges_m: Ranges | RefusalReason,
        _now_s: float,
        scan: MountedScan | None = None,
    ) -> Inputs | None:
        """Add sectors and their scan; StampError for a stamp older than the last pair's."""
        return _inputs(stamp_ns, self._pairs.add_b(stamp_ns, (ranges_m, scan)))

    def refuse(self, _name: str, _fault: str) -> None:
        """Nothing: in lockstep no stamp is refused before it is paired."""

    def stale(self, _now_s: float, _timeout_s: float) -> Inputs | None:
        """None: in lockstep time does not pass without a message."""
        return None


def _inputs(
    stamp_ns: int,
    pair: tuple[Pose2D | RefusalReason, tuple[Ranges | RefusalReason, MountedScan | None]] | None,
) -> Inputs | None:
    if pair is None:
        return None
    pose, (ranges_m, scan) = pair
    return Inputs(stamp_ns, pose, ranges_m, scan=scan)
