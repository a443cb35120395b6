# SPDX-License-Identifier: Apache-2.0
"""Extrinsics of a lidar: its pose on the robot, from a recording's /tf_static (REP-105)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ..core.errors import FrameError
from ..core.geometry import yaw_from_quaternion
from ..recording.bag_reader import BagReader

TRANSFORMS, TF_STATIC = "tf2_msgs/msg/TFMessage", "tf_static"
MIN_UPRIGHT_COS = math.cos(math.radians(5.0))  # cosine of the largest tilt of a planar lidar
Quaternion = tuple[float, float, float, float]  # x, y, z, w


class LidarExtrinsics(NamedTuple):
    """Pose of a frame in another: yaw about z, and distance of the origins in the plane."""

    yaw_rad: float
    offset_m: float


class Pose(NamedTuple):
    """Pose of a frame in another: unit quaternion, and position (m) as quaternion with w = 0."""

    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    position: Quaternion = (0.0, 0.0, 0.0, 0.0)

    def compose(self, inner: Pose) -> Pose:
        """The pose of `inner`, given in this frame, in this frame's parent."""
        x, y, z, _ = _product(_product(self.rotation, inner.position), _inverse(self.rotation))
        return Pose(
            _product(self.rotation, inner.rotation),
            (self.position[0] + x, self.position[1] + y, self.position[2] + z, 0.0),
        )

    def relative_to(self, other: Pose) -> Pose:
        """The pose of this frame in `other`, both given in the same parent."""
        inverse = _inverse(other.rotation)
        x, y, z = (a - b for a, b in zip(self.position[:3], other.position[:3]))
        return Pose(inverse).compose(Pose(self.rotation, (x, y, z, 0.0)))


class StaticFrames:
    """The tree of static transforms of a bag."""

    def __init__(self, reader: BagReader, topics: Sequence[str]) -> None:
        """Read the static transforms of some topics; of several for a frame the last is used."""
        self._parents: dict[str, tuple[str, Pose]] = {}
        for message in reader.decoded(topics) if topics else ():
            for transform in message.message.transforms:
                self._parents[transform.child_frame_id] = (
                    transform.header.frame_id,
                    _pose(transform.transform),
                )

    def extrinsics(self, frame: str, base: str) -> LidarExtrinsics:
        """The extrinsics of a frame on a base; zero if a name is empty or both are the same.

        Raises FrameError if no transforms connect the frames, and for a tilted frame.
        """
        if not (frame and base) or frame == base:
            return LidarExtrinsics(0.0, 0.0)
        frame_poses, base_poses = self._poses_in_ancestors(frame), self._poses_in_ancestors(base)
        common = next((name for name in frame_poses if name in base_poses), None)
        if common is None:
            raise FrameError(
                f"frame {frame!r}: no /tf_static gives its pose in {base!r}; give --scan-yaw"
            )
        (x, y, z, w), position = frame_poses[common].relative_to(base_poses[common])
        if not 1.0 - 2.0 * (x * x + y * y) >= MIN_UPRIGHT_COS:  # also true for NaN
            raise FrameError(
                f"frame {frame!r}: tilted against {base!r}, so its beams leave the robot's plane "
                "of motion; give --scan-yaw if they do not"
            )
        return LidarExtrinsics(
            yaw_from_quaternion(x, y, z, w), math.hypot(position[0], position[1])
        )

    def _poses_in_ancestors(self, frame: str) -> dict[str, Pose]:
        """The poses of a frame in itself and in all its ancestors, by frame."""
        poses = {frame: Pose()}
        while frame in self._parents and self._parents[frame][0] not in poses:
            parent, pose = self._parents[frame]
            poses[parent] = pose.compose(poses[frame])
            frame = parent
        return poses


def _pose(transform: Any) -> Pose:
    """geometry_msgs/Transform to a Pose; all NaN for a zero quaternion."""
    p, q = transform.translation, transform.rotation
    norm = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w) or math.nan
    return Pose((q.x / norm, q.y / norm, q.z / norm, q.w / norm), (p.x, p.y, p.z, 0.0))


def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    (a, b, c, d), (x, y, z, w) = p, q
    return (
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    )


def _inverse(q: Quaternion) -> Quaternion:
    """Inverse of a unit quaternion."""
    x, y, z, w = q
    return (-x, -y, -z, w)
