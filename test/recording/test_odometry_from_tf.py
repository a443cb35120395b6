# SPDX-License-Identifier: Apache-2.0
"""The pose of a robot by the messages of /tf, and its stamp."""

import math
from typing import Any

import pytest
from foreign_bags import transform

from mfba_planner.recording.from_messages import robot_pose, stamp_ns
from mfba_planner.recording.odometry_from_tf import OdometryFromTf
from mfba_planner.recording.transform_tree import TransformTree


class Robot:
    """Transforms of one tree, static or moving, and the odometry by them."""

    def __init__(self, *static: Any, base: str = "base_link") -> None:
        self.tree = TransformTree()
        for one in static:
            self.tree.add(one.message)
        self._by_tf = OdometryFromTf(self.tree, "/odom", base)

    def pose(self, *args: Any, **more: Any) -> tuple[int, float, float, float] | None:
        """(stamp, x, y, yaw) of the odometry by a message of /tf."""
        message = transform(*args, **more).message
        self.tree.add(message)
        found = self._by_tf.of(message)
        if found is None:
            return None
        assert (found.header.frame_id, found.child_frame_id) == ("odom", "base_link")
        return stamp_ns(found.header.stamp), *robot_pose(found, "odom")


def test_a_transform_of_the_robot_is_its_pose() -> None:
    robot = Robot()
    assert robot.pose(3_000_000_007, "odom", "base_link", x=1.0, y=2.0, yaw=0.5) == (
        pytest.approx((3_000_000_007, 1.0, 2.0, 0.5))
    )
    assert robot.pose(4, "odom", "/base_link", x=1.5) == (4, 1.5, 0.0, 0.0), "also an older one"


def test_the_same_stamp_again_is_nothing_new() -> None:
    robot = Robot()
    assert robot.pose(3, "odom", "base_link")
    assert robot.pose(3, "odom", "base_link", x=9.0) is None


def test_other_transforms_are_no_odometry() -> None:
    robot = Robot()
    assert robot.pose(1, "base_link", "wheel") is None
    assert robot.pose(1, "odom", "base_link")
    assert robot.pose(2, "map", "odom") is None
    assert robot.pose(3, "base_link", "wheel") is None


def test_static_frames_between_have_no_stamp() -> None:
    robot = Robot(transform(99, "base_footprint", "base_link", x=0.2))
    found = robot.pose(5, "odom", "base_footprint", x=1.0, yaw=0.5 * math.pi)
    assert found == pytest.approx((5, 1.0, 0.2, 0.5 * math.pi))


def test_the_stamp_is_that_of_the_oldest_moving_transform() -> None:
    robot = Robot()
    assert robot.pose(5, "odom", "base_footprint") is None
    found = [
        robot.pose(7, "base_footprint", "base_link", x=0.1),
        robot.pose(9, "odom", "base_footprint", x=1.0),
        robot.pose(10, "odom", "base_footprint", x=2.0),
        robot.pose(11, "base_footprint", "base_link", x=0.2),
    ]
    assert found == [
        pytest.approx((5, 0.1, 0.0, 0.0)), pytest.approx((7, 1.1, 0.0, 0.0)), None,
        pytest.approx((10, 2.2, 0.0, 0.0)),
    ]  # fmt: skip


def test_a_tree_whose_root_is_the_robot_works_too() -> None:
    found = Robot().pose(5, "base_link", "odom", x=1.0, yaw=0.5 * math.pi)
    assert found == pytest.approx((5, 0.0, 1.0, -0.5 * math.pi))
