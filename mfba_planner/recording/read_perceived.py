# SPDX-License-Identifier: Apache-2.0
"""The returns of a real robot's lidar, from its recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..core.errors import BagError, InputError
from ..perception.scan_to_sectors import aligned
from ..simulation.episode import Episode
from .bag_reader import BagReader
from .fleet_topics import messages_by_robot, robot_topic
from .from_messages import laser_scan, stamp_ns
from .perceived import MOST_PERCEIVED, EvenChoice, Perceived, returns_of

SCAN = "/scan"


def read_perceived(
    path: str | Path, episodes: Mapping[str, Episode], *, salvage: bool = False
) -> dict[str, tuple[Perceived, ...]]:
    """The returns of each robot by stamp, for recordings of real robots. Raises BagError."""
    real = [name for name, episode in episodes.items() if episode.start_ns is not None]
    found: dict[str, EvenChoice[Perceived]] = {name: EvenChoice(MOST_PERCEIVED) for name in real}
    poses = {name: {t.stamp_ns: t.pose for t in episodes[name].ticks} for name in real}
    with BagReader(path, salvage=salvage) as reader:
        named = [name for name in real if robot_topic(name, SCAN) in reader.topics]
        for robot, message in messages_by_robot(reader, named, [SCAN]) if named else ():
            stamp = stamp_ns(message.message.header.stamp)
            pose = poses[robot].get(stamp)
            if pose is None:
                continue
            try:
                scan = laser_scan(message.message)
            except InputError as error:
                raise BagError(f"{reader.path}: {robot_topic(robot, SCAN)}: {error}") from None
            extrinsics = episodes[robot].scenario.robot.lidar.extrinsics
            points = returns_of(aligned(scan, pose.yaw, extrinsics), pose)
            found[robot].add(Perceived(stamp, points))
    return {name: tuple(choice.items) for name, choice in found.items()}
