# SPDX-License-Identifier: Apache-2.0
"""Convert ROS messages, live or decoded from a bag, to the core's types.

Only attributes are read, so ROS is not needed. All values are checked: InputError names the
wrong one. ros/interface/to_messages.py converts in the other direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..core.errors import FrameError, InputError
from ..core.geometry import Point, Pose2D, rotated, yaw_from_quaternion
from ..core.lidar_extrinsics import LidarExtrinsics
from ..core.planner_types import Decision, Mode, Ranges, RefusalReason, Scan
from ..core.robot_base import Base
from ..perception.known_map import KnownMap, check_cells, known_map
from ..perception.no_return import NoReturn, rep_117
from ..perception.occupancy_grid import OccupancyGrid
from ..perception.sensory_vector import blind
from ..planning.differential_drive import command
from .planar_poses import plane_pose
from .transform_tree import TransformTree, frame_name

SECOND_NS = 1_000_000_000
LONGEST_SCAN_S = 10.0  # from first to last beam
FARTHEST_M = 1e7  # of a position: the largest coordinate of UTM; cells of a map count in integers

T = TypeVar("T")


def stamp_ns(stamp: Any) -> int:
    """builtin_interfaces/Time as integer nanoseconds."""
    return int(stamp.sec) * SECOND_NS + int(stamp.nanosec)


def _finite(what: str, values: Iterable[float]) -> None:
    for value in values:
        if not math.isfinite(value):
            raise InputError(f"{what} holds {value}; send finite numbers")


def _position(what: str, position: Any) -> Point:
    """The plane part of a geometry_msgs/Point; InputError for NaN, inf or beyond FARTHEST_M."""
    x, y = position.x, position.y
    _finite(what, (x, y))
    if abs(x) > FARTHEST_M or abs(y) > FARTHEST_M:
        raise InputError(
            f"{what} ({x:g}, {y:g}) is farther than {FARTHEST_M:g} m from the origin; check its "
            "source"
        )
    return (x, y)


def value_or_refusal(read: Callable[[Any], T], message: Any) -> T | RefusalReason:
    """read(message), or the text of its InputError."""
    try:
        return read(message)
    except InputError as error:
        return str(error)


def pose2d(pose: Any, what: str) -> Pose2D:
    """geometry_msgs/Pose as planar pose; yaw from the quaternion (REP-103).

    Raises InputError for NaN, inf, a position beyond FARTHEST_M or a quaternion that is no unit
    quaternion by far.
    """
    q = pose.orientation
    x, y = _position(f"{what} position", pose.position)
    _finite(f"{what} orientation", (q.x, q.y, q.z, q.w))
    norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not 1e-6 < norm < 1e6:
        raise InputError(f"{what} orientation has norm {norm:g}; send a unit quaternion (w=1)")
    return Pose2D(x, y, yaw_from_quaternion(q.x, q.y, q.z, q.w))


def require_frame(message: Any, frame: str, what: str, parameter: str = "odom_frame") -> None:
    """Raise FrameError for a message in another frame; an empty frame accepts any."""
    if frame and frame_name(message.header.frame_id) != frame_name(frame):
        raise _in_other_frame(message, frame, what, parameter)


def _in_other_frame(message: Any, frame: str, what: str, parameter: str) -> FrameError:
    given = message.header.frame_id
    return FrameError(
        f"{what} is in frame {given!r}, not {frame!r}; transform it, or set {parameter}"
    )


def robot_pose(odometry: Any, frame: str = "") -> Pose2D:
    """nav_msgs/Odometry to the robot's pose; InputError for NaN, inf or another frame."""
    require_frame(odometry, frame, "odom")
    return pose2d(odometry.pose.pose, "odom")


def goal_point(
    pose_stamped: Any,
    frame: str = "",
    what: str = "goal_pose",
    tree: TransformTree | None = None,
) -> Point:
    """geometry_msgs/PoseStamped to the goal position; its orientation is not used.

    An empty frame_id is accepted, and with a tree one that it connects with the frame. Raises
    InputError for NaN or inf, and FrameError for another frame.
    """
    position = _position(f"{what} position", pose_stamped.pose.position)
    given = frame_name(pose_stamped.header.frame_id)
    if not (given and frame) or given == frame_name(frame):
        return position
    if tree is None:
        raise _in_other_frame(pose_stamped, frame, what, "odom_frame")
    try:
        pose = plane_pose(tree, given, frame)
    except FrameError:
        raise FrameError(
            f"{what} is in frame {given!r}, not {frame!r}, and no tf gives the one in the other; "
            f"start the localization that publishes it, or send {what} in {frame!r}"
        ) from None
    dx, dy = rotated(position, pose.yaw)
    return (pose.x + dx, pose.y + dy)


def waypoint_points(
    path: Any, frame: str = "", tree: TransformTree | None = None
) -> tuple[Point, ...]:
    """nav_msgs/Path to a sequence of goals; InputError for no pose, NaN, inf or another frame.

    A pose without frame_id is in the frame of the path. Raises InputError as goal_point().
    """
    if not path.poses:
        raise InputError("waypoints are empty; give at least one, or call planner/cancel")
    return tuple(
        goal_point(
            pose if pose.header.frame_id else _In(path.header, pose.pose),
            frame,
            f"waypoint {number}",
            tree,
        )
        for number, pose in enumerate(path.poses, start=1)
    )


class _In(NamedTuple):
    """A pose with the header of its path, as a PoseStamped."""

    header: Any
    pose: Any


def obstacle_centers(pose_array: Any) -> list[Point]:
    """geometry_msgs/PoseArray to centres; InputError for NaN or inf."""
    centers = []
    for number, pose in enumerate(pose_array.poses, start=1):
        _finite(f"obstacles pose {number}", (pose.position.x, pose.position.y))
        centers.append((pose.position.x, pose.position.y))
    return centers


def sector_ranges(laser_scan: Any, frame: str = "") -> Ranges:
    """The sectors topic (LaserScan) to ranges in m; inf means free.

    Raises InputError for NaN, -inf, fewer than 3 sectors or another frame.
    """
    require_frame(laser_scan, frame, "sectors")
    ranges = tuple(float(r) for r in laser_scan.ranges)
    if len(ranges) < 3:
        raise InputError(f"sectors hold {len(ranges)} ranges; send one per sector, at least 3")
    for number, r in enumerate(ranges, start=1):
        if math.isnan(r) or r < 0.0:
            raise InputError(blind(number, r))
    return ranges


def laser_scan(message: Any, frame: str = "", no_return: NoReturn = NoReturn.INF) -> Scan:
    """sensor_msgs/LaserScan to a Scan.

    Beams that turn clockwise are put in reverse sequence, unless it is that of their times: then
    the increment is below 0. no_return is the range by which the driver reports that nothing is
    there. Raises FrameError for another frame, and InputError where the fields contradict each
    other; perception.scan_to_sectors.sense_scan checks the ranges. As some drivers leave angle_max
    at 0 or one increment too far, it is only compared roughly, and not where both limits are 0.
    """
    require_frame(message, frame, "scan", "scan_frame")
    count, increment = len(message.ranges), message.angle_increment
    first, last = message.angle_min, message.angle_max
    if not count:
        raise InputError("scan holds 0 ranges; check the lidar driver")
    _finite("scan angle_min, angle_max or angle_increment", (first, last, increment))
    if not message.range_max > message.range_min >= 0.0:
        raise InputError(
            f"scan has range_min={message.range_min:g}, range_max={message.range_max:g}: not "
            "0 <= range_min < range_max; check the lidar driver"
        )
    if count > 1 and increment == 0.0:
        raise InputError(
            f"scan of {count} beams has angle_increment=0: all in one direction; "
            "check the lidar driver"
        )
    unset = first == last == 0.0 or (count == 1 and (first == last or increment == 0.0))
    spanned = count if unset else (last - first) / increment + 1.0
    if abs(spanned - count) > max(1.5, 0.02 * count):
        raise InputError(
            f"scan holds {count} ranges, but angle_min={first:g}, angle_max={last:g} and "
            f"angle_increment={increment:g} make {spanned:.0f}; check the lidar driver"
        )
    time_s = float(message.time_increment)
    if not 0.0 <= time_s * count <= LONGEST_SCAN_S:
        raise InputError(
            f"scan of {count} beams has time_increment={time_s:g} s: not from 0 to "
            f"{LONGEST_SCAN_S:g} s in all; check the lidar driver"
        )
    ranges = rep_117(message.ranges, message.range_max, no_return)
    if increment < 0.0 and not time_s:
        first, increment, ranges = first + (count - 1) * increment, -increment, ranges[::-1]
    return Scan(
        ranges_m=ranges,
        angle_min_rad=first,
        angle_increment_rad=increment,
        range_min_m=message.range_min,
        range_max_m=min(message.range_max, FARTHEST_M),  # a return from beyond tells nothing
        time_increment_s=time_s,
    )


def occupancy_grid(message: Any) -> OccupancyGrid:
    """nav_msgs/OccupancyGrid to a map; InputError where the fields contradict each other."""
    info = message.info
    _finite("occupancy grid resolution", (info.resolution,))
    if not info.resolution > 0.0:
        raise InputError(f"occupancy grid has resolution={info.resolution:g} m; send more than 0")
    if len(message.data) != info.width * info.height:
        raise InputError(
            f"occupancy grid holds {len(message.data)} cells, but width={info.width} and "
            f"height={info.height} make {info.width * info.height}; check its publisher"
        )
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
    origin = pose2d(info.origin, "occupancy grid origin")
    return OccupancyGrid(stamp_ns(message.header.stamp), origin, info.resolution, cells)


def known_map_from(message: Any, frame: str = "") -> KnownMap:
    """nav_msgs/OccupancyGrid to a map known before the drive; InputError as known_map()."""
    given = message.header.frame_id
    if frame and given != frame:
        raise FrameError(
            f"map is in frame {given!r}, not {frame!r}, and no tf is read; set the map server's "
            f"frame_id to {frame!r} if the robot starts at the map's origin"
        )
    check_cells(message.info.height, message.info.width)
    return known_map(occupancy_grid(message))


def velocity(twist: Any) -> tuple[float, float, float]:
    """geometry_msgs/Twist(Stamped) to body-frame (vx, vy, wz); InputError for NaN or inf."""
    twist = getattr(twist, "twist", twist)
    values = (twist.linear.x, twist.linear.y, twist.angular.z)
    _finite("cmd_vel", values)
    return values


def body_velocity(decision: Decision, base: Base, tick_ns: int) -> tuple[float, float, float]:
    """The cmd_vel of a decision: (vx, vy, wz) in the body frame, m/s and rad/s."""
    v = command(decision, base, tick_ns)
    return (v[0], 0.0, v[1]) if base.turns else (*rotated(v, -decision.pose.yaw), 0.0)


def command_from_twist(twist: Any, base: Base, yaw_rad: float) -> Point:
    """Twist to the command of World.step, for a base with this yaw; raises as velocity()."""
    vx, vy, wz = velocity(twist)
    return (vx, wz) if base.turns else rotated((vx, vy), yaw_rad)


def points_text(values: Iterable[Point]) -> str:
    """Points as text 'x,y x,y', which parses back to the same floats."""
    return " ".join(f"{x!r},{y!r}" for x, y in values)


def parse_points(text: str) -> tuple[Point, ...]:
    """Inverse of points_text; InputError for anything else."""
    try:
        pairs = [tuple(map(float, pair.split(","))) for pair in text.split()]
        return tuple((x, y) for x, y in pairs)
    except ValueError:
        raise InputError(f"{text!r}: not a list of points 'x,y x,y'") from None


def decision_field(diagnostics: Any, key: str) -> str:
    """The value of one key of planner/decision, "" without that key."""
    return next((item.value for item in diagnostics.status[0].values if item.key == key), "")


def scan_fields(pose_stamp_ns: int | None, scan_pose: Pose2D) -> dict[str, str]:
    """Keys of planner/decision for a scan older than the pose: its pose, and the pose's stamp."""
    return {"pose_stamp_ns": str(pose_stamp_ns), "scan_pose": ",".join(map(repr, scan_pose))}


def scan_timing(diagnostics: Any) -> tuple[int | None, Pose2D | None]:
    """Inverse of scan_fields, None without them. InputError if malformed."""
    stamp, pose = (decision_field(diagnostics, key) for key in ("pose_stamp_ns", "scan_pose"))
    if not stamp and not pose:
        return None, None
    try:
        x, y, yaw = map(float, pose.split(","))
        return int(stamp), Pose2D(x, y, yaw)
    except ValueError as error:
        raise InputError(f"planner/decision: malformed {error}; was it edited?") from None


def extrinsics_fields(extrinsics: LidarExtrinsics) -> dict[str, str]:
    """Key of planner/decision for a scan whose lidar is mounted as tf says."""
    return {"scan_extrinsics": ",".join(repr(float(value)) for value in extrinsics)}


def extrinsics_in(diagnostics: Any) -> LidarExtrinsics | None:
    """Inverse of extrinsics_fields, None without it. InputError if malformed."""
    text = decision_field(diagnostics, "scan_extrinsics")
    if not text:
        return None
    try:
        x, y, yaw, flipped = map(float, text.split(","))
    except ValueError as error:
        raise InputError(f"planner/decision: malformed {error}; was it edited?") from None
    return LidarExtrinsics(x, y, yaw, bool(flipped))


def decision(diagnostics: Any, ranges_m: Ranges) -> Decision:
    """planner/decision and the ranges of its stamp to a Decision; InputError if malformed."""
    try:
        status = diagnostics.status[0]
        fields = {item.key: item.value for item in status.values}
        goal = parse_points(fields["goal"])
        x, y, yaw = map(float, fields["pose"].split(","))
        return Decision(
            stamp_ns=stamp_ns(diagnostics.header.stamp),
            mode=Mode(fields["mode"]),
            reason=status.message,
            pose=Pose2D(x, y, yaw),
            goal=goal[0] if goal else None,
            ranges_m=ranges_m,
            vs=tuple(map(int, fields["vs"])),
            vg=tuple(map(int, fields["vg"])),
            gap=int(fields["gap"]),
            waypoint=parse_points(fields["waypoint"])[0],
            velocity=parse_points(fields["velocity"])[0],
            candidates=parse_points(fields["candidates"]),
            perception=fields.get("perception", ""),
        )
    except (KeyError, ValueError, IndexError) as error:
        raise InputError(
            f"planner/decision: missing or malformed {error}; was it edited?"
        ) from None
