# SPDX-License-Identifier: Apache-2.0
"""How a lidar is mounted on its robot, as a recording's /tf_static has it (REP-105)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..core.errors import FrameError
from ..core.geometry import yaw_of
from ..recording.bag_reader import BagReader

TRANSFORMS, TF_STATIC = "tf2_msgs/msg/TFMessage", "tf_static"
UPRIGHT = math.cos(math.radians(5.0))  # of a lidar that scans the robot's plane: least cosine
Quaternion = tuple[float, float, float, float]  # x, y, z, w


class LidarExtrinsics(NamedTuple):
    """How a frame stands in another: turned about z, and how far off in the plane."""

    yaw_rad: float
    offset_m: float


class Pose(NamedTuple):
    """A frame in another: a unit quaternion, and a position (m) as a quaternion with w = 0."""

    turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    at: Quaternion = (0.0, 0.0, 0.0, 0.0)

    def of(self, inner: Pose) -> Pose:
        """The pose, where this one is given, of what stands at inner in this frame."""
        x, y, z, _ = _product(_product(self.turn, inner.at), _inverse(self.turn))
        return Pose(
            _product(self.turn, inner.turn), (self.at[0] + x, self.at[1] + y, self.at[2] + z, 0.0)
        )

    def seen_from(self, other: Pose) -> Pose:
        """This frame in another, both of them given in a third."""
        back = _inverse(other.turn)
        x, y, z = (a - b for a, b in zip(self.at[:3], other.at[:3]))
        return Pose(back).of(Pose(self.turn, (x, y, z, 0.0)))


class StaticFrames:
    """The tree of frames that do not move against each other."""

    def __init__(self, reader: BagReader) -> None:
        """Read all static transforms of a bag; the last that was said of a frame holds."""
        self._above: dict[str, tuple[str, Pose]] = {}
        topics = [
            name
            for name, topic in reader.topics.items()
            if topic.type_name == TRANSFORMS and name.rpartition("/")[2] == TF_STATIC
        ]
        for message in reader.decoded(topics) if topics else ():
            for told in message.message.transforms:
                self._above[told.child_frame_id] = told.header.frame_id, _pose(told.transform)

    def extrinsics(self, frame: str, base: str) -> LidarExtrinsics:
        """How a frame is mounted on a base; of one that has no name nothing is to be known.

        Raises FrameError where no transforms lead from one to the other, and for a frame whose
        plane is not the base's.
        """
        if not (frame and base) or frame == base:
            return LidarExtrinsics(0.0, 0.0)
        ours, theirs = self._upwards(frame), self._upwards(base)
        common = next((name for name in ours if name in theirs), None)
        if common is None:
            raise FrameError(
                f"frame {frame!r}: no /tf_static says how it stands in {base!r}; give --scan-yaw"
            )
        (x, y, z, w), at = ours[common].seen_from(theirs[common])
        if not 1.0 - 2.0 * (x * x + y * y) >= UPRIGHT:  # nor is one whose quaternion is none
            raise FrameError(
                f"frame {frame!r}: tilted against {base!r}, so its beams leave the plane that the "
                "robot moves in; give --scan-yaw if they do not"
            )
        return LidarExtrinsics(yaw_of(x, y, z, w), math.hypot(at[0], at[1]))

    def _upwards(self, frame: str) -> dict[str, Pose]:
        """The poses of a frame in itself and in all frames above it."""
        poses = {frame: Pose()}
        while frame in self._above and self._above[frame][0] not in poses:
            above, pose = self._above[frame]
            poses[above] = pose.of(poses[frame])
            frame = above
        return poses


def _pose(transform: Any) -> Pose:
    """geometry_msgs/Transform; all NaN where its quaternion is none."""
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
    """Of a unit quaternion."""
    x, y, z, w = q
    return (-x, -y, -z, w)
