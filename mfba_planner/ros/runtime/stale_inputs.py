# SPDX-License-Identifier: Apache-2.0
"""What a planner decides on: pairs of one stamp, or the newest of each and how old it is."""

from __future__ import annotations

from typing import NamedTuple

from ...core.errors import StampError
from ...core.geometry import Pose2D
from ...core.types import Ranges, Refused
from .stamp_pairing import StampPairs


def watch_period_s(timeout_s: float, *, lockstep: bool) -> float:
    """How often to look whether an input has fallen silent for longer than timeout_s."""
    return 0.5 if lockstep else min(max(0.25 * timeout_s, 0.02), 0.25)


class Ready(NamedTuple):
    """Something to decide on."""

    stamp_ns: int
    pose: Pose2D | Refused
    ranges_m: Ranges | Refused
    age_s: float = 0.0


class Lockstep:
    """Each stamp when both its odom and its sectors are there; the last one also once more."""

    def __init__(self) -> None:
        """Start with nothing."""
        self._pairs: StampPairs[Pose2D | Refused, Ranges | Refused] = StampPairs(again=True)

    def odom(self, stamp_ns: int, pose: Pose2D | Refused, _now_s: float) -> Ready | None:
        """Take odom; StampError for a stamp that was answered before."""
        pair = self._pairs.add_a(stamp_ns, pose)
        return Ready(stamp_ns, *pair) if pair else None

    def sectors(self, stamp_ns: int, ranges_m: Ranges | Refused, _now_s: float) -> Ready | None:
        """Take sectors; StampError for a stamp that was answered before."""
        pair = self._pairs.add_b(stamp_ns, ranges_m)
        return Ready(stamp_ns, *pair) if pair else None


class Newest:
    """Real time: every sectors message, with the newest odom; now_s is of any steady clock."""

    def __init__(self) -> None:
        """Start with nothing."""
        self._pose: Pose2D | Refused = "no odom yet"
        self._ranges: Ranges | Refused = "no sectors yet"
        self._odom_ns = self._sectors_ns = -1
        self._odom_s = self._sectors_s = 0.0

    def odom(self, stamp_ns: int, pose: Pose2D | Refused, now_s: float) -> Ready | None:
        """Keep odom for the next sectors; StampError for a stamp that goes back."""
        if stamp_ns < max(self._odom_ns, 0):
            raise StampError(_goes_back("odom", stamp_ns, self._odom_ns))
        if stamp_ns > self._odom_ns:  # the same once more is no news: it does not make it younger
            self._odom_s = now_s
        self._odom_ns, self._pose = stamp_ns, pose
        return None

    def sectors(self, stamp_ns: int, ranges_m: Ranges | Refused, now_s: float) -> Ready | None:
        """Answer sectors; StampError for a stamp that does not rise."""
        if stamp_ns <= self._sectors_ns:
            raise StampError(_goes_back("sectors", stamp_ns, self._sectors_ns))
        self._sectors_ns, self._ranges, self._sectors_s = stamp_ns, ranges_m, now_s
        return self._ready(now_s - self._odom_s if self._odom_ns >= 0 else 0.0)

    def stale(self, now_s: float, timeout_s: float) -> Ready | None:
        """What to decide on again because it has become too old; None before any sectors."""
        oldest_s = min(self._sectors_s, self._odom_s if self._odom_ns >= 0 else self._sectors_s)
        too_old = self._sectors_ns >= 0 and now_s - oldest_s > timeout_s
        return self._ready(now_s - oldest_s) if too_old else None

    def _ready(self, age_s: float) -> Ready:
        return Ready(self._sectors_ns, self._pose, self._ranges, age_s)


def _goes_back(what: str, stamp_ns: int, last_ns: int) -> str:
    return (
        f"{what} stamp {stamp_ns} ns: not newer than {last_ns} ns; stamps must rise "
        "(a clock that was set back is noticed with use_sim_time)"
    )
