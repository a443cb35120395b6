# SPDX-License-Identifier: Apache-2.0
"""What a real robot perceived, for pictures: the returns of its lidar, and tracked obstacles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from ..core.geometry import Point, Pose2D
from ..core.planner_types import Scan

MOST_PERCEIVED = 400  # of a run

T = TypeVar("T")


class TrackedCircle(NamedTuple):
    """A tracked obstacle, not enlarged; at rest its velocity is 0."""

    center_m: Point
    radius_m: float
    velocity_mps: Point


class Perceived(NamedTuple):
    """Returns (n, 2) in m, single precision, in odom, and the tracks, at the stamp of a scan."""

    stamp_ns: int
    points_m: np.ndarray
    tracks: tuple[TrackedCircle, ...] = ()


RobotPerceived = Mapping[str, Sequence[Perceived]]
NOTHING_PERCEIVED: RobotPerceived = MappingProxyType({})


class EvenChoice(Generic[T]):
    """At most `most` of the items added, evenly apart, the first one included."""

    def __init__(self, most: int) -> None:
        """Start without items."""
        self.items: list[T] = []
        self.stride = 1
        self._most, self._count = most, 0

    @property
    def takes_next(self) -> bool:
        """Whether the next item will be kept."""
        return self._count % self.stride == 0

    def add(self, item: T | None) -> None:
        """Add the next item; it may be None if it will not be kept."""
        if self.takes_next and item is not None:
            self.items.append(item)
        self._count += 1
        if len(self.items) > self._most:
            del self.items[1::2]
            self.stride *= 2


def returns_of(scan: Scan, pose: Pose2D) -> np.ndarray:
    """The returns (n, 2) of a scan aligned with odom, taken at a pose."""
    ranges = np.asarray(scan.ranges_m, dtype=np.float64)
    hit = np.isfinite(ranges) & (ranges >= scan.range_min_m) & (ranges <= scan.range_max_m)
    angles = scan.angles_rad(np.flatnonzero(hit))
    points = np.column_stack((np.cos(angles), np.sin(angles))) * ranges[hit, None]
    return (points + scan.taken_from(pose).position).astype(np.float32)
