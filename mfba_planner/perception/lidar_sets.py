# SPDX-License-Identifier: Apache-2.0
"""Which scans of several lidars on one topic belong together, and when to perceive by them."""

from __future__ import annotations

from collections import deque
from typing import Generic, NamedTuple, TypeVar

from ..core.planner_types import NANO

T = TypeVar("T")

_KEPT = 32  # scans of a lidar
LONGEST_S = 2.0  # that poses are known back
_MISSED = 2.0  # periods after which a scan is not waited for


class LidarScan(NamedTuple, Generic[T]):
    """A scan of the lidar with this frame; value is whatever the caller keeps of it."""

    frame: str
    stamp_ns: int
    value: T


class LidarSets(Generic[T]):
    """The newest scan of each lidar, told apart by the frames of their scans.

    A set is perceived by when a scan arrives, unless that of another lidar is about to: one whose
    stamp, going on by its period, is nearer than its last one. It is waited for until the first
    lidar sends again. So lidars that measure at the same time give one perception for each pair,
    in whatever order the messages arrive, and those that take turns one for each scan. Its stamp
    is that of the newest scan, and rises.
    """

    def __init__(self) -> None:
        """Start without lidars."""
        self._lidars: dict[str, deque[LidarScan[T]]] = {}
        self._waiting: set[str] = set()  # the lidars whose newest scan waits for another's
        self._perceived_ns = -1

    @property
    def are_several(self) -> bool:
        """Whether there are scans to merge: of more than one lidar, one of them silent or not."""
        return len(self._lidars) > 1

    @property
    def newest_ns(self) -> int:
        """The newest stamp of all; -1 without scans."""
        return max((scans[-1].stamp_ns for scans in self._lidars.values()), default=-1)

    def add(self, frame: str, stamp_ns: int, value: T, limit_s: float) -> bool:
        """Add a scan; whether to perceive now by newest(). Of one lidar alone each scan counts.

        A frame of "" is that of any lidar alone, until another has a frame.
        """
        if frame:
            self._lidars.pop("", None)
        scans = self._lidars.setdefault(frame, deque(maxlen=_KEPT))
        scan = LidarScan(frame, stamp_ns, value)
        if not self.are_several:
            while scans and scans[-1].stamp_ns >= stamp_ns:  # it is the newest, whatever it says
                scans.pop()
            scans.append(scan)
            self._perceived_ns = stamp_ns
            return True
        if scans and stamp_ns <= scans[-1].stamp_ns:
            return False
        scans.append(scan)
        newest_ns = self.newest_ns
        if newest_ns <= self._perceived_ns:
            return False
        limit_ns = _limit_ns(limit_s)
        alive = (
            others
            for name, others in self._lidars.items()
            if name != frame and newest_ns - others[-1].stamp_ns <= limit_ns
        )
        if frame not in self._waiting and any(_is_due(other, scans) for other in alive):
            self._waiting.add(frame)
            return False
        self._waiting.clear()
        self._perceived_ns = newest_ns
        return True

    def newest(self, limit_s: float) -> tuple[LidarScan[T], ...]:
        """The newest scan of each lidar, by frame, but those older than the newest by more."""
        return self.at(self.newest_ns, limit_s)

    def at(self, stamp_ns: int, limit_s: float) -> tuple[LidarScan[T], ...]:
        """The newest scans up to a stamp, but those older by more than limit_s."""
        oldest_ns = stamp_ns - _limit_ns(limit_s)
        found = []
        for _, scans in sorted(self._lidars.items()):
            before = [scan for scan in scans if oldest_ns <= scan.stamp_ns <= stamp_ns]
            found += before[-1:]
        return tuple(found)

    def silence(self, limit_s: float) -> str:
        """Which lidars have not sent for longer than limit_s while others have, "" if none."""
        oldest_ns = self.newest_ns - _limit_ns(limit_s)
        silent = [name for name, scans in self._lidars.items() if scans[-1].stamp_ns < oldest_ns]
        if not silent:
            return ""
        return (
            f"no scan in frame {', '.join(map(repr, sorted(silent)))} for more than "
            f"{_limit_ns(limit_s) * NANO:g} s: what only that lidar covers is not known"
        )


def _limit_ns(limit_s: float) -> int:
    return round(min(limit_s, LONGEST_S) / NANO)


def _is_due(other: deque[LidarScan[T]], own: deque[LidarScan[T]]) -> bool:
    """Whether the next scan of another lidar will belong to the newest of one's own."""
    behind_ns = own[-1].stamp_ns - other[-1].stamp_ns
    period_ns = _period_ns(other) or _period_ns(own)
    if behind_ns <= 0 or not period_ns:
        return False
    return abs(behind_ns - period_ns) < behind_ns and behind_ns < _MISSED * period_ns


def _period_ns(scans: deque[LidarScan[T]]) -> int:
    return scans[-1].stamp_ns - scans[-2].stamp_ns if len(scans) > 1 else 0
