# SPDX-License-Identifier: Apache-2.0
"""Where the robots of a bag truly were, as the simulated world published it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ..core.errors import BagError, InputError
from ..core.geometry import Point, Pose2D
from ..core.planner_types import NANO
from ..simulation.triggers import Moment
from .bag_reader import BagReader
from .fleet_topics import NO_NAMESPACE, messages_by_robot, robot_topic
from .from_messages import robot_pose, stamp_ns
from .run_setup import Setup

ODOM, TRUTH = "/odom", "/ground_truth"  # odometry with errors is recorded beside the truth


def read_truth(reader: BagReader, setups: Mapping[str, Setup]) -> dict[str, dict[int, Pose2D]]:
    """The true pose of each robot by stamp; empty where decisions hold it, or nobody knows it.

    In real time a decision may be on odometry older than its stamp, so the odometry of a simulated
    robot without errors is read then. Raises BagError for a pose that is none.
    """
    recorded: dict[str, dict[int, Pose2D]] = {robot: {} for robot in setups}
    topic = TRUTH
    if not any(robot_topic(robot, TRUTH) in reader.topics for robot in setups):
        if all(setup.lockstep or not setup.is_simulated for setup in setups.values()):
            return recorded
        topic = ODOM
    for robot, message in messages_by_robot(reader, list(setups), [topic]):
        odom = message.message
        try:
            recorded[robot].setdefault(stamp_ns(odom.header.stamp), robot_pose(odom))
        except InputError as error:
            raise BagError(f"{reader.path}: {robot_topic(robot, topic)}: {error}") from None
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
