# SPDX-License-Identifier: Apache-2.0
"""The odometry of a robot that sends it on /tf only: its pose in odom, with a stamp."""

from __future__ import annotations

from typing import Any

from ..core.errors import FrameError
from ..core.planner_types import NANO
from .from_messages import stamp_ns
from .message_fields import Header, OdometryFields, Pose, PoseOnly, Quaternion, Time, Vector
from .transform_tree import TransformTree, frame_name

ODOM_FRAME, BASE_FRAME = "odom", "base_link"  # REP-105
_SECOND_NS = round(1.0 / NANO)


class OdometryFromTf:
    """The pose of the robot's frame in that of the odometry, by the messages of /tf.

    Its stamp is that until which all moving transforms between the two frames are known.
    """

    def __init__(self, tree: TransformTree, odom_frame: str, base_frame: str) -> None:
        """The tree takes each message before of() does."""
        self._tree = tree
        self.odom_frame, self.base_frame = frame_name(odom_frame), frame_name(base_frame)
        self._stamps: dict[str, int] = {}  # of the newest transform of /tf, by child frame
        self._last_ns = -1

    def of(self, message: Any) -> OdometryFields | None:
        """The odometry by a message of /tf, None if it tells nothing new of the robot's pose."""
        for transform in message.transforms:
            stamp = stamp_ns(transform.header.stamp)
            self._stamps[frame_name(transform.child_frame_id)] = stamp
        frames = self._tree.frames_between(self.base_frame, self.odom_frame)
        moving = [self._stamps[frame] for frame in frames if frame in self._stamps]
        if not moving or min(moving) == self._last_ns:
            return None
        try:
            rotation, position = self._tree.pose(self.base_frame, self.odom_frame)
        except FrameError:
            return None
        self._last_ns = min(moving)
        pose = Pose(Vector(*position[:3]), Quaternion(*rotation))
        header = Header(Time(*divmod(self._last_ns, _SECOND_NS)), self.odom_frame)
        return OdometryFields(header, self.base_frame, PoseOnly(pose))
