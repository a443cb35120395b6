# SPDX-License-Identifier: Apache-2.0
"""The returns of a real robot's lidars, from its recording."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.errors import BagError, InputError
from ..core.lidar_extrinsics import CENTRED, LidarExtrinsics
from ..core.planner_types import Scan
from ..perception.scan_to_sectors import aligned
from ..simulation.episode import Episode
from .bag_reader import BagReader
from .decisions_with_sectors import DECISION
from .fleet_topics import messages_by_robot, robot_topic
from .from_messages import decision_field, laser_scan, stamp_ns
from .perceived import MOST_PERCEIVED, EvenChoice, Perceived, returns_of
from .scan_parts import FRAME_FIELD, ScanPart, merge_again, parts_in

SCAN = "/scan"
_Name = tuple[str, int]  # of a scan: frame, stamp in ns
_RECENT = 64  # scans, among which the parts of a merged one are looked for


def read_perceived(
    path: str | Path, episodes: Mapping[str, Episode], *, salvage: bool = False
) -> dict[str, tuple[Perceived, ...]]:
    """The returns of each robot by stamp, for recordings of real robots. Raises BagError."""
    real = [name for name, episode in episodes.items() if episode.start_ns is not None]
    with BagReader(path, salvage=salvage) as reader:
        named = [name for name in real if robot_topic(name, SCAN) in reader.topics]
        robots = {name: _Returns(reader, name, episodes[name]) for name in named}
        for robot, message in messages_by_robot(reader, named, [SCAN]) if named else ():
            robots[robot].add(message.message)
    return {name: tuple(robots[name].found.items) if name in robots else () for name in real}


class _Returns:
    """The returns of one robot's scans, as its decisions used them."""

    def __init__(self, reader: BagReader, robot: str, episode: Episode) -> None:
        self.found: EvenChoice[Perceived] = EvenChoice(MOST_PERCEIVED)
        self._where = f"{reader.path}: {robot_topic(robot, SCAN)}"
        self._poses = {tick.stamp_ns: tick.pose for tick in episode.ticks}
        self._extrinsics = episode.scenario.robot.lidar.extrinsics
        self._radius_m = episode.scenario.robot_radius_m
        self._recent: deque[Any] = deque(maxlen=_RECENT)
        self._merged: dict[int, tuple[ScanPart, ...]] = {}  # by the stamp of the decision
        self._frames: dict[int, str] = {}  # of a single lidar's scan, where there were others
        self._stamps: dict[_Name, list[int]] = {}  # of the decisions by each scan
        try:
            for _, message in messages_by_robot(reader, [robot], [DECISION]):
                stamp = stamp_ns(message.message.header.stamp)
                self._frames[stamp] = decision_field(message.message, FRAME_FIELD)
                if stamp not in self._merged and (parts := parts_in(message.message)):
                    self._merged[stamp] = parts
                    for part in parts:
                        self._stamps.setdefault((part.frame, part.stamp_ns), []).append(stamp)
        except InputError as error:
            raise BagError(f"{reader.path}: {error}") from None

    def add(self, message: Any) -> None:
        """Add a scan. Raises BagError."""
        try:
            frame, stamp = _name(message)
            self._recent.append(message)
            for merged_ns in self._stamps.get((frame, stamp), ()):
                self._add_merged(merged_ns)
            is_used = self._frames.get(stamp) in ("", frame)
            if is_used and stamp in self._poses and stamp not in self._merged:
                self._keep(stamp, laser_scan(message), self._extrinsics)
        except InputError as error:
            raise BagError(f"{self._where}: {error}") from None

    def _add_merged(self, stamp: int) -> None:
        """Merge the scans of a decision, once all of them were read."""
        read, parts = {_name(message): message for message in self._recent}, self._merged[stamp]
        messages = [read.get((part.frame, part.stamp_ns)) for part in parts]
        if stamp in self._poses and all(messages):
            merged = merge_again(parts, messages, laser_scan, self._radius_m)
            self._keep(stamp, merged, CENTRED)

    def _keep(self, stamp: int, scan: Scan, extrinsics: LidarExtrinsics) -> None:
        pose = self._poses[stamp]
        points = returns_of(aligned(scan, pose.yaw, extrinsics), pose)
        self.found.add(Perceived(stamp, points))


def _name(message: Any) -> _Name:
    return message.header.frame_id, stamp_ns(message.header.stamp)
