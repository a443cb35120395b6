# SPDX-License-Identifier: Apache-2.0
"""Joins odom and sectors into a planner's inputs: by stamp, or the newest of each and its age."""

from __future__ import annotations

from ...core.errors import StampError
from ...core.geometry import Pose2D
from ...core.planner_types import Ranges, RefusalReason
from ...perception.pose_history import PoseHistory
from ...recording.scan_parts import MountedScan
from .lockstep_inputs import Inputs


def watch_period_s(timeout_s: float, *, lockstep: bool) -> float:
    """How often to check whether an input is older than timeout_s."""
    return 0.5 if lockstep else min(max(0.25 * timeout_s, 0.02), 0.25)


class NewestInputs:
    """Real time: each sectors message with the newest odom; now_s is of any steady clock.

    With a scan, odometry of another stamp is brought to the stamps: see _newest.
    """

    def __init__(self) -> None:
        """Start with nothing received."""
        self._pose: Pose2D | RefusalReason = "no odom yet"
        self._ranges: Ranges | RefusalReason = "no sectors yet"
        self._scan: MountedScan | None = None
        self._history = PoseHistory()
        self._odom_ns = self._sectors_ns = -1
        self._odom_s = self._sectors_s = 0.0

    def add_odom(self, stamp_ns: int, pose: Pose2D | RefusalReason, now_s: float) -> Inputs | None:
        """Keep odom for the next sectors; StampError for a stamp that goes back."""
        if stamp_ns < max(self._odom_ns, 0):
            raise StampError(_goes_back("odom", stamp_ns, self._odom_ns))
        if stamp_ns > self._odom_ns:  # the same stamp again does not make odom younger
            self._odom_s = now_s
        self._odom_ns, self._pose = stamp_ns, pose
        if not isinstance(pose, str):
            self._history.add(stamp_ns, pose)
        return None

    def add_sectors(
        self,
        stamp_ns: int,
        ranges_m: Ranges | RefusalReason,
        now_s: float,
        scan: MountedScan | None = None,
    ) -> Inputs | None:
        """Return sectors with the newest odom; StampError for a stamp that does not rise."""
        if stamp_ns <= self._sectors_ns:
            raise StampError(_goes_back("sectors", stamp_ns, self._sectors_ns))
        self._sectors_ns, self._ranges, self._sectors_s = stamp_ns, ranges_m, now_s
        self._scan = scan
        return self._newest(now_s - self._odom_s if self._odom_ns >= 0 else 0.0)

    def refuse(self, name: str, fault: str) -> None:
        """A message of odom or sectors is refused, and its stamp has no place among the others.

        Its reason takes the place of what is known; no decision follows, unless one is due.
        """
        if name == "odom":
            self._pose = fault
        else:
            self._ranges, self._scan = fault, None

    def stale(self, now_s: float, timeout_s: float) -> Inputs | None:
        """The newest inputs if one is older than timeout_s; None before any sectors."""
        oldest_s = min(self._sectors_s, self._odom_s if self._odom_ns >= 0 else self._sectors_s)
        too_old = self._sectors_ns >= 0 and now_s - oldest_s > timeout_s
        return self._newest(now_s - oldest_s) if too_old else None

    def _newest(self, age_s: float) -> Inputs:
        """With a scan that is older than odom: also the pose at the scan's stamp.

        With a scan that is newer, the pose is brought to its stamp.
        """
        inputs = Inputs(self._sectors_ns, self._pose, self._ranges, age_s, self._scan)
        at_scan = self._history.at(self._sectors_ns)
        if self._scan is None or isinstance(self._pose, str) or at_scan is None:
            return inputs
        if self._odom_ns <= self._sectors_ns:
            return inputs._replace(pose=at_scan)
        return inputs._replace(pose_stamp_ns=self._odom_ns, sensed=(self._sectors_ns, at_scan))


def _goes_back(what: str, stamp_ns: int, last_ns: int) -> str:
    return (
        f"{what} stamp {stamp_ns} ns: not newer than {last_ns} ns; stamps must rise "
        "(a clock that was set back is noticed with use_sim_time)"
    )
