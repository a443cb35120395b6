# SPDX-License-Identifier: Apache-2.0
"""Recordings of other robots, written with rosbags: scans, odometry, goals, transforms."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

SECOND = 1_000_000_000
TICK_NS = SECOND // 10
START_NS = 1_700_000_000 * SECOND
BEAMS = 360
_STORE, _STORE_1 = get_typestore(Stores.ROS2_JAZZY), get_typestore(Stores.ROS1_NOETIC)
_TRANSFORMS = "geometry_msgs/TransformStamped[] transforms"
_STORE_1.register(get_types_from_msg(_TRANSFORMS, "tf2_msgs/msg/TFMessage"))


class Recorded(NamedTuple):
    """A message of a topic, and its log time in ns."""

    topic: str
    time_ns: int
    message: Any


def made(name: str, store: Any = _STORE, **fields: Any) -> Any:
    """A message of a type; fields that are not given are zero, empty or none."""
    return store.types[name](**fields)


def _header(stamp_ns: int, frame: str) -> Any:
    sec, nanosec = divmod(stamp_ns, SECOND)
    stamp = made("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
    return made("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _quaternion(yaw: float, roll: float = 0.0) -> Any:
    c, s, cr, sr = (f(0.5 * angle) for angle in (yaw, roll) for f in (math.cos, math.sin))
    return made("geometry_msgs/msg/Quaternion", x=c * sr, y=s * sr, z=s * cr, w=c * cr)


def _vector(x: float = 0.0, y: float = 0.0, name: str = "Vector3") -> Any:
    return made(f"geometry_msgs/msg/{name}", x=float(x), y=float(y), z=0.0)


def _pose(x: float, y: float, yaw: float = 0.0) -> Any:
    position = _vector(x, y, "Point")
    return made("geometry_msgs/msg/Pose", position=position, orientation=_quaternion(yaw))


def odom(
    stamp_ns: int,
    x: float = 0.0,
    y: float = 0.0,
    *,
    yaw: float = 0.0,
    frame: str = "odom",
    child: str = "base_link",
    topic: str = "/odom",
    time_ns: int | None = None,
) -> Recorded:
    """An Odometry at a pose."""
    still = made("geometry_msgs/msg/Twist", linear=_vector(), angular=_vector())
    message = made(
        "nav_msgs/msg/Odometry",
        header=_header(stamp_ns, frame),
        child_frame_id=child,
        pose=made(
            "geometry_msgs/msg/PoseWithCovariance", pose=_pose(x, y, yaw), covariance=np.zeros(36)
        ),
        twist=made("geometry_msgs/msg/TwistWithCovariance", twist=still, covariance=np.zeros(36)),
    )
    return Recorded(topic, stamp_ns if time_ns is None else time_ns, message)


def scan(
    stamp_ns: int,
    ranges: Sequence[float] = (),
    *,
    frame: str = "laser",
    range_min: float = 0.12,
    topic: str = "/scan",
    time_ns: int | None = None,
) -> Recorded:
    """A scan of the whole circle from beam 0 along +x on, by default of nothing."""
    values = np.array(ranges if len(ranges) else [math.inf] * BEAMS, np.float32)
    step = 2.0 * math.pi / len(values)
    message = made(
        "sensor_msgs/msg/LaserScan",
        header=_header(stamp_ns, frame),
        angle_min=0.0,
        angle_max=step * (len(values) - 1),
        angle_increment=step,
        time_increment=0.0,
        scan_time=0.1,
        range_min=range_min,
        range_max=3.5,
        ranges=values,
        intensities=np.zeros(0, np.float32),
    )
    return Recorded(topic, stamp_ns + 1 if time_ns is None else time_ns, message)


def goal(
    time_ns: int, x: float, y: float, *, frame: str = "odom", topic: str = "/goal_pose"
) -> Recorded:
    """A goal pose."""
    message = made(
        "geometry_msgs/msg/PoseStamped", header=_header(time_ns, frame), pose=_pose(x, y)
    )
    return Recorded(topic, time_ns, message)


def transform(
    time_ns: int,
    parent: str = "base_link",
    child: str = "laser",
    *,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    roll: float = 0.0,
    topic: str = "/tf_static",
) -> Recorded:
    """One transform."""
    value = made(
        "geometry_msgs/msg/Transform", translation=_vector(x, y), rotation=_quaternion(yaw, roll)
    )
    stamped = made(
        "geometry_msgs/msg/TransformStamped",
        header=_header(time_ns, parent),
        child_frame_id=child,
        transform=value,
    )
    return Recorded(topic, time_ns, made("tf2_msgs/msg/TFMessage", transforms=[stamped]))


def wall(at_deg: int, width_deg: int = 40, range_m: float = 0.6) -> list[float]:
    """The ranges of a wall around a direction, nothing elsewhere."""
    ranges = [math.inf] * BEAMS
    for k in range(-width_deg // 2, width_deg // 2):
        ranges[(at_deg + k) % BEAMS] = range_m
    return ranges


def drive(count: int = 40, ranges: Sequence[float] | None = None) -> list[Recorded]:
    """A recording of a robot that drives along +x with a wall on its left, to a goal at x = 5."""
    found = [transform(START_NS), goal(START_NS + 1, 5.0, 0.0)]
    for k in range(1, count + 1):
        stamp = START_NS + k * TICK_NS
        found += [odom(stamp, 0.01 * k), scan(stamp, wall(90) if ranges is None else ranges)]
    return found


def steps(*makers: Callable[[int], Recorded], count: int = 20) -> list[Recorded]:
    """The messages that the makers give for the stamps of `count` ticks."""
    stamps = [START_NS + k * TICK_NS for k in range(1, count + 1)]
    return [maker(stamp) for stamp in stamps for maker in makers]


def write(
    path: Path,
    messages: Iterable[Recorded],
    *,
    storage: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
    version: Literal[8, 9] = 9,
    empty: Iterable[tuple[str, str]] = (),
) -> Path:
    """A rosbag2 bag; `empty` are (topic, type) without messages."""
    writer = Writer(path, version=version, storage_plugin=storage)
    if compression is not CompressionMode.NONE:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    connections: dict[str, Any] = {}
    with writer:
        for topic, type_name in empty:
            writer.add_connection(topic, type_name, typestore=_STORE)
        for topic, time_ns, message in sorted(messages, key=lambda found: found.time_ns):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=_STORE)
            writer.write(connections[topic], time_ns, _STORE.serialize_cdr(message, kind))
    return path


def write_ros1(path: Path, messages: Iterable[Recorded]) -> Path:
    """The same messages as a ROS 1 bag."""
    connections: dict[str, Any] = {}
    with Writer1(path) as writer:
        for topic, time_ns, message in sorted(messages, key=lambda found: found.time_ns):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=_STORE_1)
            data = _STORE_1.serialize_ros1(_as_ros1(message), kind)
            writer.write(connections[topic], time_ns, data)
    return path


def _as_ros1(value: Any) -> Any:
    """A message with the Header of ROS 1, which has a sequence number."""
    if isinstance(value, list):
        return [_as_ros1(item) for item in value]
    kind = getattr(value, "__msgtype__", "")
    if not kind:
        return value
    fields = {
        name: _as_ros1(item) for name, item in vars(value).items() if not name.startswith("_")
    }
    if kind == "std_msgs/msg/Header":
        fields["seq"] = 0
    return made(kind, _STORE_1, **fields)
