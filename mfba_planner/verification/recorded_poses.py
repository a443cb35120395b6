# SPDX-License-Identifier: Apache-2.0
"""All poses of a recording, by stamp and by log time, in 40 bytes each."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

from ..core.geometry import Pose2D
from ..core.planner_types import RefusalReason
from ..recording.bag_reader import DecodedMessage


class RecordedPose(NamedTuple):
    """A pose, or why it is refused, and its stamp in ns."""

    stamp_ns: int
    pose: Pose2D | RefusalReason


class RecordedPoses:
    """The poses of messages with rising stamps."""

    def __init__(
        self,
        messages: Iterable[tuple[int, DecodedMessage]],
        read: Callable[[Any], Pose2D | RefusalReason],
    ) -> None:
        """Read all messages, each with its stamp; `read` gives the pose of one."""
        self._stamps, self._times = array("q"), array("q")
        self._values = array("d")  # x, y, yaw of each; 0 where it is refused
        self._refusals: dict[int, RefusalReason] = {}
        for stamp, message in messages:
            pose = read(message.message)
            if isinstance(pose, str):
                self._refusals[len(self._stamps)] = pose
                pose = Pose2D(0.0, 0.0)
            self._values.extend(pose)
            self._stamps.append(stamp)
            self._times.append(message.log_time_ns)

    def __len__(self) -> int:
        """Number of poses."""
        return len(self._stamps)

    def at(self, stamp_ns: int) -> RecordedPose | None:
        """The pose of a stamp, None if there is none."""
        index = bisect_left(self._stamps, stamp_ns)
        if index == len(self._stamps) or self._stamps[index] != stamp_ns:
            return None
        return self._get(index)

    def newest(self, log_time_ns: int) -> RecordedPose | None:
        """The newest pose recorded up to a log time, None without one."""
        index = bisect_right(self._times, log_time_ns)
        return self._get(index - 1) if index else None

    def between(self, after_ns: int, log_time_ns: int) -> Iterator[RecordedPose]:
        """Those recorded after a log time and up to another."""
        for index in range(
            bisect_right(self._times, after_ns), bisect_right(self._times, log_time_ns)
        ):
            yield self._get(index)

    def _get(self, index: int) -> RecordedPose:
        pose = self._refusals.get(index) or Pose2D(*self._values[3 * index : 3 * index + 3])
        return RecordedPose(self._stamps[index], pose)
