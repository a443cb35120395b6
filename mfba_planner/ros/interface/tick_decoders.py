# SPDX-License-Identifier: Apache-2.0
"""Decoders of the messages of every tick: the fields that nodes read, without message objects.

rclpy constructs every object inside a message, twice, and reads all covariances: 40 us for an
Odometry. These named tuples have the same attributes, as far as from_messages.py reads them.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

from geometry_msgs.msg import PoseArray, Twist
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import LaserScan

from ...recording.message_fields import (
    Header,
    OdometryFields,
    Pose,
    PoseOnly,
    Quaternion,
    Time,
    Vector,
)

_ODOMETRY_DOUBLES = 7 + 36 + 6 + 36  # pose and twist, each with its covariance
_BODY = 4  # bytes of the encapsulation; alignment begins after them
_ORDERS = {b"\0\0": ">", b"\0\1": "<"}  # of plain CDR, version 1


class PoseArrayFields(NamedTuple):
    """geometry_msgs/PoseArray."""

    header: Header
    poses: list[Pose]


class LaserScanFields(NamedTuple):
    """sensor_msgs/LaserScan."""

    header: Header
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: array[float]
    intensities: array[float]


class TwistFields(NamedTuple):
    """geometry_msgs/Twist."""

    linear: Vector
    angular: Vector


def _odometry(data: bytes, order: str) -> OdometryFields:
    header, at = _header(data, order)
    child_frame_id, at = _string(data, order, at)
    (pose,) = _poses(data, order, at, 1)
    if _aligned(at, 8) + _ODOMETRY_DOUBLES * 8 > len(data):
        raise ValueError("shorter than an Odometry")
    return OdometryFields(header, child_frame_id, PoseOnly(pose))


def _pose_array(data: bytes, order: str) -> PoseArrayFields:
    header, at = _header(data, order)
    at = _aligned(at, 4)
    (count,) = struct.unpack_from(order + "I", data, at)
    return PoseArrayFields(header, _poses(data, order, at + 4, count))


def _laser_scan(data: bytes, order: str) -> LaserScanFields:
    header, at = _header(data, order)
    at = _aligned(at, 4)
    numbers = struct.unpack_from(order + "7f", data, at)
    ranges, at = _floats(data, order, at + 28)
    intensities, at = _floats(data, order, at)
    return LaserScanFields._make((header, *numbers, ranges, intensities))


def _twist(data: bytes, order: str) -> TwistFields:
    values = struct.unpack_from(order + "6d", data, _BODY)
    return TwistFields(Vector(*values[:3]), Vector(*values[3:]))


_DECODERS: dict[Any, Callable[[bytes, str], Any]] = {
    Odometry: _odometry,
    PoseArray: _pose_array,
    LaserScan: _laser_scan,
    Twist: _twist,
}


def decoder(message_type: Any) -> Callable[[bytes], Any] | None:
    """A function that decodes serialized messages of this type; None for other types."""
    decode = _DECODERS.get(message_type)
    if decode is None:
        return None

    def decode_any(data: bytes) -> Any:
        order = _ORDERS.get(data[:2])
        if order is not None:
            try:
                return decode(data, order)
            except (struct.error, ValueError):  # too short: rclpy tells what is wrong
                pass
        return deserialize_message(data, message_type)

    return decode_any


def _aligned(at: int, size: int) -> int:
    return at + (_BODY - at) % size


def _header(data: bytes, order: str) -> tuple[Header, int]:
    """The header, and where it ends."""
    sec, nanosec = struct.unpack_from(order + "iI", data, _BODY)
    frame_id, at = _string(data, order, _BODY + 8)
    return Header(Time(sec, nanosec), frame_id), at


def _string(data: bytes, order: str, at: int) -> tuple[str, int]:
    """A string, which ends at its first NUL, and where its bytes end."""
    at = _aligned(at, 4)
    (length,) = struct.unpack_from(order + "I", data, at)
    end = at + 4 + length
    text = data[at + 4 : end].split(b"\0", 1)[0]
    return text.decode(errors="replace"), end


def _poses(data: bytes, order: str, at: int, count: int) -> list[Pose]:
    if not count:
        return []
    v = struct.unpack_from(f"{order}{7 * count}d", data, _aligned(at, 8))
    return [
        Pose(Vector(v[k], v[k + 1], v[k + 2]), Quaternion(v[k + 3], v[k + 4], v[k + 5], v[k + 6]))
        for k in range(0, 7 * count, 7)
    ]


def _floats(data: bytes, order: str, at: int) -> tuple[array[float], int]:
    """A sequence of floats, and where it ends."""
    at = _aligned(at, 4)
    (count,) = struct.unpack_from(order + "I", data, at)
    end = at + 4 + 4 * count
    if end > len(data):
        raise ValueError("longer than the message")
    values = array("f", data[at + 4 : end])
    if order != _NATIVE:
        values.byteswap()
    return values, end


_NATIVE = "<" if struct.pack("=H", 1) == struct.pack("<H", 1) else ">"
