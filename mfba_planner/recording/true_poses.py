# SPDX-License-Identifier: Apache-2.0
"""Where the robots of a bag truly were, as the simulated world published it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..core.errors import BagError, InputError
from ..core.geometry import Point, Pose2D
from ..core.planner_types import NANO
from ..simulation.triggers import Moment
from .bag_reader import BagReader
from .fleet_topics import NO_NAMESPACE, messages_by_robot, robot_topic
from .from_messages import robot_pose, stamp_ns

ODOM, TRUTH = "/odom", "/ground_truth"  # odometry with errors is recorded beside the truth


def read_truth(reader: BagReader, robots: Sequence[str]) -> dict[str, dict[int, Pose2D]]:
    """The true pose of each robot by stamp; empty if the bag has no ground truth."""
    recorded: dict[str, dict[int, Pose2D]] = {robot: {} for robot in robots}
    if not any(robot_topic(robot, TRUTH) in reader.topics for robot in robots):
        return recorded
    for robot, message in messages_by_robot(reader, robots, [TRUTH]):
        odom = message.message
        try:
            recorded[robot][stamp_ns(odom.header.stamp)] = robot_pose(odom)
        except InputError as error:
            raise BagError(f"{reader.path}: {robot_topic(robot, TRUTH)}: {error}") from None
    return recorded


def recorded_moments(reader: BagReader, robots: Sequence[str], tick_ns: int) -> Iterator[Moment]:
    """Time and true positions of all robots (() for a single one) at each tick, ascending.

    Reads the bag when the first one is asked for. Of a message published twice the first counts;
    poses that are none are left out.
    """
    names = robots or (NO_NAMESPACE,)
    is_true = any(robot_topic(robot, TRUTH) in reader.topics for robot in names)
    moments: dict[int, dict[str, Point]] = {}
    for robot, message in messages_by_robot(reader, names, [TRUTH if is_true else ODOM]):
        odom = message.message
        try:
            position = robot_pose(odom).position
        except InputError:
            continue
        moments.setdefault(stamp_ns(odom.header.stamp), {}).setdefault(robot, position)
    for stamp, positions in sorted(moments.items()):
        yield (stamp - tick_ns) * NANO, list(positions.values())
