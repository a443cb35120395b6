# SPDX-License-Identifier: Apache-2.0
"""Decoded messages have the attributes of rclpy's, whoever has sent them."""

import struct
from array import array
from typing import Any

import pytest
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseArray,
    PoseStamped,
    Quaternion,
    Twist,
    Vector3,
)
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan

from mfba_planner.ros.interface.tick_decoders import decoder

FLOATS = st.floats(width=64)
SINGLES = st.floats(width=32)
TEXTS = st.text(max_size=11)
QUATERNIONS = st.builds(Quaternion, x=FLOATS, y=FLOATS, z=FLOATS, w=FLOATS)
POSES = st.builds(
    Pose, position=st.builds(Point, x=FLOATS, y=FLOATS, z=FLOATS), orientation=QUATERNIONS
)
VECTORS = st.builds(Vector3, x=FLOATS, y=FLOATS, z=FLOATS)


@st.composite
def with_header(draw: st.DrawFn, message_type: Any) -> Any:
    message = message_type()
    message.header.stamp.sec = draw(st.integers(-(2**31), 2**31 - 1))
    message.header.stamp.nanosec = draw(st.integers(0, 2**32 - 1))
    message.header.frame_id = draw(TEXTS)
    return message


def decoded(message: Any) -> tuple[Any, Any]:
    """The decoded message, and what rclpy makes of the same bytes."""
    decode = decoder(type(message))
    assert decode
    data = serialize_message(message)
    return decode(data), deserialize_message(data, type(message))


def same(a: Any, b: Any, *paths: str) -> None:
    """Both have the same values, to the last bit of every float, at these paths."""
    for path in paths:
        x, y = a, b
        for name in path.split("."):
            x, y = getattr(x, name), getattr(y, name)
        assert repr(x) == repr(y), path


_HEADER = ("header.stamp.sec", "header.stamp.nanosec", "header.frame_id")
_POSITION = ("position.x", "position.y", "position.z")
_POSE = (*_POSITION, "orientation.x", "orientation.y", "orientation.z", "orientation.w")


@given(with_header(Odometry), TEXTS, POSES, st.lists(FLOATS, min_size=36, max_size=36), VECTORS)
def test_odometry(message: Any, child: str, pose: Pose, covariance: Any, velocity: Any) -> None:
    message.child_frame_id, message.pose.pose = child, pose
    message.pose.covariance, message.twist.twist.linear = covariance, velocity
    same(*decoded(message), *_HEADER, "child_frame_id", *(f"pose.pose.{name}" for name in _POSE))


@given(with_header(PoseArray), st.lists(POSES, max_size=5))
def test_poses(message: Any, poses: list[Pose]) -> None:
    message.poses = poses
    ours, theirs = decoded(message)
    same(ours, theirs, *_HEADER)
    assert len(ours.poses) == len(theirs.poses) == len(poses)
    for a, b in zip(ours.poses, theirs.poses):
        same(a, b, *_POSE)


@given(
    with_header(LaserScan),
    st.lists(SINGLES, min_size=7, max_size=7),
    st.lists(SINGLES, max_size=9),
    st.lists(SINGLES, max_size=9),
)
def test_scans(message: Any, numbers: Any, ranges: Any, intensities: Any) -> None:
    names = (
        "angle_min",
        "angle_max",
        "angle_increment",
        "time_increment",
        "scan_time",
        "range_min",
        "range_max",
    )
    for name, value in zip(names, numbers):
        setattr(message, name, value)
    message.ranges, message.intensities = array("f", ranges), array("f", intensities)
    same(*decoded(message), *_HEADER, *names, "ranges", "intensities")


@given(st.builds(Twist, linear=VECTORS, angular=VECTORS))
def test_twists(message: Twist) -> None:
    fields = [f"{part}.{axis}" for part in ("linear", "angular") for axis in "xyz"]
    same(*decoded(message), *fields)


def test_the_other_byte_order() -> None:
    text = struct.pack(">I", 5) + b"odom\0"
    head = b"\0\0\0\0" + struct.pack(">iI", 7, 8) + text
    scan = head + b"\xff" * 3 + struct.pack(">7f", 1, 2, 3, 4, 5, 6, 7)
    scan += struct.pack(">I2f", 2, 1.5, float("inf")) + struct.pack(">I", 0)
    odometry = head + b"\xff" * 3 + struct.pack(">I", 5) + b"base\0" + b"\xff" * 6
    odometry += struct.pack(">7d", 1, 2, 3, 0, 0, 0, 1) + bytes(8 * (36 + 6 + 36))
    poses = head + b"\xff" * 3 + struct.pack(">I", 1) + b"\xff" * 4
    poses = poses[: 4 + 8 * ((len(poses) - 4) // 8)] + struct.pack(">7d", 1, 2, 3, 0, 0, 0, 1)
    twist = b"\0\0\0\0" + struct.pack(">6d", 1, 2, 3, 4, 5, 6)
    for message_type, data, paths in (
        (LaserScan, scan, [*_HEADER, "range_max", "ranges", "intensities"]),
        (Odometry, odometry, [*_HEADER, "child_frame_id", "pose.pose.position.x"]),
        (PoseArray, poses, [*_HEADER]),
        (Twist, twist, ["linear.y", "angular.z"]),
    ):
        decode = decoder(message_type)
        assert decode
        found, expected = decode(data), deserialize_message(data, message_type)
        assert type(found) is not message_type
        same(found, expected, *paths)
    assert decoder(PoseArray)(poses).poses[0].position.y == 2.0  # type: ignore[misc]


@pytest.mark.parametrize("message_type", [Odometry, PoseArray, LaserScan, Twist])
def test_what_is_too_short_is_as_with_rclpy(message_type: Any) -> None:
    decode = decoder(message_type)
    assert decode
    data = serialize_message(message_type())
    for length in (4, 9, len(data) // 2):
        try:
            expected = repr(deserialize_message(data[:length], message_type))
        except Exception as error:
            with pytest.raises(type(error)):
                decode(data[:length])
        else:
            assert repr(decode(data[:length])) == expected


def test_other_encodings_and_types_are_left_to_rclpy() -> None:
    assert decoder(PoseStamped) is None
    decode = decoder(Twist)
    assert decode
    data = bytearray(serialize_message(Twist()))
    data[1] = 3  # a parameter list
    assert isinstance(decode(bytes(data)), Twist)
