# SPDX-License-Identifier: Apache-2.0
"""Messages as named tuples: the fields that from_messages.py reads, without message objects."""

from __future__ import annotations

from typing import NamedTuple


class Time(NamedTuple):
    """builtin_interfaces/Time."""

    sec: int
    nanosec: int


class Header(NamedTuple):
    """std_msgs/Header."""

    stamp: Time
    frame_id: str


class Vector(NamedTuple):
    """geometry_msgs/Point or Vector3."""

    x: float
    y: float
    z: float


class Quaternion(NamedTuple):
    """geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


class Pose(NamedTuple):
    """geometry_msgs/Pose."""

    position: Vector
    orientation: Quaternion


class PoseOnly(NamedTuple):
    """geometry_msgs/PoseWithCovariance without the covariance."""

    pose: Pose


class OdometryFields(NamedTuple):
    """nav_msgs/Odometry without twist and covariances."""

    header: Header
    child_frame_id: str
    pose: PoseOnly
