# SPDX-License-Identifier: Apache-2.0
"""Poses in the plane from a tree of frames: where a lidar is mounted, where a map is in odom."""

from __future__ import annotations

import math

from ..core.errors import FrameError
from ..core.geometry import Pose2D, yaw_from_quaternion
from ..core.lidar_extrinsics import CENTRED, LidarExtrinsics
from .transform_tree import TransformTree

_LEAST_UPRIGHT_COS = math.cos(math.radians(5.0))  # cosine of the largest tilt of a planar frame


def lidar_extrinsics(tree: TransformTree, frame: str, base: str) -> LidarExtrinsics:
    """The extrinsics of a lidar with this frame on a base; none if a name is empty.

    Raises FrameError if no transforms connect the frames, and for a tilted frame.
    """
    if not (frame and base):
        return CENTRED
    (x, y, z, w), position = tree.pose(frame, base)
    upright = 1.0 - 2.0 * (x * x + y * y)  # cosine of the angle between the vertical axes
    if not abs(upright) >= _LEAST_UPRIGHT_COS:  # also true for NaN
        raise FrameError(
            f"frame {frame!r}: tilted against {base!r}, so its beams leave the robot's plane of "
            "motion"
        )
    yaw = yaw_from_quaternion(x, y, z, w)
    return LidarExtrinsics(position[0], position[1], yaw, flipped=upright < 0.0)


def plane_pose(tree: TransformTree, frame: str, base: str) -> Pose2D:
    """The pose of a frame in another in the plane.

    Raises FrameError if no transforms connect the frames, and for a tilted frame.
    """
    (x, y, z, w), position = tree.pose(frame, base)
    if not 1.0 - 2.0 * (x * x + y * y) >= _LEAST_UPRIGHT_COS:
        raise FrameError(f"frame {frame!r}: tilted against {base!r}")
    return Pose2D(position[0], position[1], yaw_from_quaternion(x, y, z, w))
