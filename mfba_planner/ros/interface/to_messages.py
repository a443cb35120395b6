# SPDX-License-Identifier: Apache-2.0
"""Converts core values to messages; recording/from_messages.py holds the other direction."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose, PoseArray, PoseStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header, MultiArrayDimension, UInt8MultiArray

from ...core.geometry import Point, Pose2D, quaternion_from_yaw, rotated
from ...core.planner_types import Bits, Decision, Mode, Ranges, Scan
from ...core.robot_base import Base
from ...perception import occupancy_grid
from ...perception.sensory_vector import SensorParams, bits_text, longest_range_m
from ...planning.odometry_jump import is_odometry_jump
from ...recording.from_messages import SECOND_NS, body_velocity, points_text
from ...simulation.episode import Outcome
from .diagnostic_status import Status

OMNIDIRECTIONAL = Base()

# Messages are constructed empty and then filled in: a value passed to a constructor costs twice,
# as rclpy's message classes construct the default as well.


def set_stamp(stamp: Time, stamp_ns: int) -> None:
    """Write integer nanoseconds into a builtin_interfaces/Time."""
    stamp.sec, stamp.nanosec = divmod(stamp_ns, SECOND_NS)


def time_msg(stamp_ns: int) -> Time:
    """Integer nanoseconds as builtin_interfaces/Time."""
    message = Time()
    set_stamp(message, stamp_ns)
    return message


def set_header(header: Header, stamp_ns: int, frame_id: str) -> Header:
    """Fill in a header; return it."""
    set_stamp(header.stamp, stamp_ns)
    header.frame_id = frame_id
    return header


def set_pose(pose: Pose, x: float, y: float, yaw_rad: float = 0.0) -> Pose:
    """Fill in a planar pose (REP-103); return it."""
    pose.position.x, pose.position.y = x, y
    if yaw_rad:  # the default is no rotation
        pose.orientation.z, pose.orientation.w = quaternion_from_yaw(yaw_rad)
    return pose


def pose_msg(x: float, y: float, yaw_rad: float = 0.0) -> Pose:
    """A planar pose (REP-103)."""
    return set_pose(Pose(), x, y, yaw_rad)


def clock_msg(stamp_ns: int) -> Clock:
    """Simulated time."""
    message = Clock()
    set_stamp(message.clock, stamp_ns)
    return message


def odometry_msg(
    pose: Pose2D,
    velocity: Point,
    stamp_ns: int,
    frame_id: str,
    child_frame_id: str,
    yaw_rate_radps: float = 0.0,
) -> Odometry:
    """The robot's pose in frame_id; velocity (odom frame, m/s) is given in the body frame."""
    message = Odometry()
    set_header(message.header, stamp_ns, frame_id)
    message.child_frame_id = child_frame_id
    set_pose(message.pose.pose, *pose)
    linear = message.twist.twist.linear
    linear.x, linear.y = rotated(velocity, -pose.yaw)
    message.twist.twist.angular.z = yaw_rate_radps
    return message


def scan_msg(scan: Scan, stamp_ns: int, frame_id: str) -> LaserScan:
    """A scan of a simulated lidar; all beams are measured at the stamp."""
    message = LaserScan()
    set_header(message.header, stamp_ns, frame_id)
    message.angle_min, message.angle_increment = scan.angle_min_rad, scan.angle_increment_rad
    message.angle_max = scan.angle_min_rad + (scan.ranges_m.size - 1) * scan.angle_increment_rad
    message.range_min, message.range_max = scan.range_min_m, scan.range_max_m
    message.ranges = array("f", scan.ranges_m)
    return message


def obstacles_msg(centers: Sequence[Point], stamp_ns: int, frame_id: str) -> PoseArray:
    """Obstacle centres, as the scenario lists them."""
    message = PoseArray()
    set_header(message.header, stamp_ns, frame_id)
    message.poses = [pose_msg(x, y) for x, y in centers]
    return message


def sectors_msg(
    ranges_m: Ranges, params: SensorParams, robot_radius_m: float, stamp_ns: int, frame_id: str
) -> LaserScan:
    """One beam per sector, through its middle; inf is free; intensities are a(i) of eq. 11."""
    width = 2.0 * math.pi / len(ranges_m)
    finite = [r for r in ranges_m if math.isfinite(r)]
    message = LaserScan()
    set_header(message.header, stamp_ns, frame_id)
    message.angle_min = 0.5 * width
    message.angle_max = 2.0 * math.pi - 0.5 * width
    message.angle_increment = width
    message.range_max = max([longest_range_m(params, robot_radius_m), *finite])
    message.ranges = array("f", ranges_m)
    message.intensities = array("f", map(math.isfinite, ranges_m))
    return message


def sensory_vector_msg(vs: Bits) -> UInt8MultiArray:
    """Vs of eq. 11 for people, bags and plots."""
    message = UInt8MultiArray()
    message.layout.dim = [MultiArrayDimension(label="sector", size=len(vs), stride=len(vs))]
    message.data = array("B", vs)
    return message


def pose_stamped_msg(point: Point, stamp_ns: int, frame_id: str) -> PoseStamped:
    """A goal or goal step."""
    message = PoseStamped()
    set_header(message.header, stamp_ns, frame_id)
    set_pose(message.pose, *point)
    return message


def path_msg(points: Sequence[Point], stamp_ns: int, frame_id: str) -> Path:
    """A polyline."""
    message = Path()
    set_header(message.header, stamp_ns, frame_id)
    message.poses = [pose_stamped_msg(point, stamp_ns, frame_id) for point in points]
    return message


def plan_points(decision: Decision) -> list[Point]:
    """Polyline from the pose over the goal step to the goal."""
    points = [decision.pose.position]
    if decision.waypoint != points[-1]:
        points.append(decision.waypoint)
    if decision.goal is not None and decision.goal != points[-1]:
        points.append(decision.goal)
    return points


def plan_msg(decision: Decision, frame_id: str) -> Path:
    """plan_points() as a message."""
    return path_msg(plan_points(decision), decision.stamp_ns, frame_id)


def occupancy_grid_msg(grid: occupancy_grid.OccupancyGrid, frame_id: str) -> OccupancyGrid:
    """A map; its origin has a yaw where the map has corrected the odometry's heading."""
    message = OccupancyGrid()
    set_header(message.header, grid.stamp_ns, frame_id)
    set_stamp(message.info.map_load_time, grid.stamp_ns)
    message.info.height, message.info.width = grid.cells.shape
    message.info.resolution = grid.cell_m
    set_pose(message.info.origin, *grid.origin)
    message.data = array("b", grid.cells.tobytes())
    return message


def twist_msg(decision: Decision, base: Base = OMNIDIRECTIONAL, tick_ns: int = 0) -> Twist:
    """The goal step as a velocity in the body frame (m/s, rad/s), as the base can follow it."""
    message = Twist()
    linear = message.linear
    linear.x, linear.y, message.angular.z = body_velocity(decision, base, tick_ns)
    return message


def twist_stamped_msg(
    decision: Decision, frame_id: str, base: Base = OMNIDIRECTIONAL, tick_ns: int = 0
) -> TwistStamped:
    """twist_msg with a stamp, as Nav2's enable_stamped_cmd_vel."""
    message = TwistStamped(twist=twist_msg(decision, base, tick_ns))
    set_header(message.header, decision.stamp_ns, frame_id)
    return message


_NO_FIELDS: Mapping[str, str] = MappingProxyType({})
_LEVELS = {
    Mode.BLOCKED: DiagnosticStatus.WARN,
    Mode.STOPPED: DiagnosticStatus.ERROR,
}


def decision_msg(
    decision: Decision,
    algorithm: str,
    refused: int,
    name: str,
    fields: Mapping[str, str] = _NO_FIELDS,
) -> DiagnosticArray:
    """A decision in full; floats as text that gives back the same floats."""
    values = {
        "mode": decision.mode.value,
        "vs": bits_text(decision.vs),
        "vg": bits_text(decision.vg),
        "gap": str(decision.gap),
        "pose": ",".join(map(repr, decision.pose)),
        "goal": points_text([decision.goal] if decision.goal else []),
        "waypoint": points_text([decision.waypoint]),
        "velocity": points_text([decision.velocity]),
        "candidates": points_text(decision.candidates),
        "perception": decision.perception,
        "algorithm": algorithm,
        "refused_inputs": str(refused),
        **fields,
    }
    status = DiagnosticStatus(level=_LEVELS.get(decision.mode, DiagnosticStatus.OK), name=name)
    status.message = decision.reason
    if is_odometry_jump(decision.reason) and status.level == DiagnosticStatus.OK:
        status.level = DiagnosticStatus.WARN
    status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
    message = DiagnosticArray(status=[status])
    set_stamp(message.header.stamp, decision.stamp_ns)
    return message


def diagnostics_msg(
    statuses: Sequence[Status], node_name: str, hardware_id: str, stamp_ns: int
) -> DiagnosticArray:
    """Statuses as /diagnostics has them, each named 'node: status'."""
    message = DiagnosticArray()
    set_stamp(message.header.stamp, stamp_ns)
    for status in statuses:
        values = [KeyValue(key=key, value=value) for key, value in status.values.items()]
        message.status.append(
            DiagnosticStatus(
                level=bytes([status.level]),
                name=f"{node_name}: {status.name}",
                message=status.message,
                hardware_id=hardware_id,
                values=values,
            )
        )
    return message


def outcome_msg(outcome: Outcome | None, ticks: int) -> DiagnosticStatus:
    """How a run ended, None: it is running; ticks counts those published."""
    return DiagnosticStatus(
        name="run",
        message=outcome.value if outcome else "running",
        values=[KeyValue(key="ticks", value=str(ticks))],
    )
