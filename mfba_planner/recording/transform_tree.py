# SPDX-License-Identifier: Apache-2.0
"""The tree of frames of tf2_msgs/TFMessage, live or from a bag (REP-105)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..core.errors import FrameError

Quaternion = tuple[float, float, float, float]  # x, y, z, w


class FramePose(NamedTuple):
    """Pose of a frame in another: unit quaternion, and position (m) as quaternion with w = 0."""

    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    position: Quaternion = (0.0, 0.0, 0.0, 0.0)

    def compose(self, inner: FramePose) -> FramePose:
        """The pose of `inner`, given in this frame, in this frame's parent."""
        x, y, z, _ = _product(_product(self.rotation, inner.position), _inverse(self.rotation))
        return FramePose(
            _product(self.rotation, inner.rotation),
            (self.position[0] + x, self.position[1] + y, self.position[2] + z, 0.0),
        )

    def relative_to(self, other: FramePose) -> FramePose:
        """The pose of this frame in `other`, both given in the same parent."""
        inverse = _inverse(other.rotation)
        x, y, z = (a - b for a, b in zip(self.position[:3], other.position[:3]))
        return FramePose(inverse).compose(FramePose(self.rotation, (x, y, z, 0.0)))


class TransformTree:
    """The newest pose of each frame in its parent; names are taken without a leading slash."""

    def __init__(self) -> None:
        """Start without frames."""
        self._parents: dict[str, tuple[str, FramePose]] = {}

    def copy(self) -> TransformTree:
        """A tree with the same frames."""
        other = TransformTree()
        other._parents.update(self._parents)
        return other

    def add(self, message: Any) -> None:
        """Add the transforms of a TFMessage."""
        for transform in message.transforms:
            self._parents[frame_name(transform.child_frame_id)] = (
                frame_name(transform.header.frame_id),
                _pose(transform.transform),
            )

    def pose(self, frame: str, base: str) -> FramePose:
        """The pose of a frame in another. Raises FrameError if no transforms connect them."""
        frame, base = frame_name(frame), frame_name(base)
        if frame == base:
            return FramePose()
        frame_poses, base_poses = self._poses_in_ancestors(frame), self._poses_in_ancestors(base)
        common = next((name for name in frame_poses if name in base_poses), None)
        if common is None:
            raise FrameError(f"frame {frame!r}: no /tf_static or /tf gives its pose in {base!r}")
        return frame_poses[common].relative_to(base_poses[common])

    def frames_between(self, frame: str, base: str) -> set[str]:
        """The frames whose transforms give the pose of a frame in another; none without any."""
        first, other = (set(self._poses_in_ancestors(frame_name(name))) for name in (frame, base))
        return first ^ other if first & other else set()

    def _poses_in_ancestors(self, frame: str) -> dict[str, FramePose]:
        """The poses of a frame in itself and in all its ancestors, by frame."""
        poses = {frame: FramePose()}
        while frame in self._parents and self._parents[frame][0] not in poses:
            parent, pose = self._parents[frame]
            poses[parent] = pose.compose(poses[frame])
            frame = parent
        return poses


def frame_name(frame: str) -> str:
    """The name of a frame: ROS 1 and old drivers put a slash before it."""
    return frame.removeprefix("/")


def _pose(transform: Any) -> FramePose:
    """geometry_msgs/Transform to a pose; all NaN for a zero quaternion."""
    p, q = transform.translation, transform.rotation
    norm = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w) or math.nan
    return FramePose((q.x / norm, q.y / norm, q.z / norm, q.w / norm), (p.x, p.y, p.z, 0.0))


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
