# SPDX-License-Identifier: Apache-2.0
"""The core's values as messages; mfba_planner/messages.py holds the other direction."""

from __future__ import annotations

import math
from collections.abc import Sequence

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import Pose, PoseArray, PoseStamped, Quaternion, Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header, MultiArrayDimension, MultiArrayLayout, UInt8MultiArray

from ..core.episode import Outcome
from ..core.geometry import Point, Pose2D
from ..core.planner import Decision, Mode
from ..core.sensing import Bits, Ranges, SensorParams, longest_range_m
from ..messages import SECOND_NS, bits_text, points_text, rotated


def time_msg(stamp_ns: int) -> Time:
    """Integer nanoseconds as builtin_interfaces/Time."""
    return Time(sec=stamp_ns // SECOND_NS, nanosec=stamp_ns % SECOND_NS)


def header(stamp_ns: int, frame_id: str) -> Header:
    """A header."""
    return Header(stamp=time_msg(stamp_ns), frame_id=frame_id)


def clock_msg(stamp_ns: int) -> Clock:
    """Simulated time."""
    return Clock(clock=time_msg(stamp_ns))


def pose_msg(x: float, y: float, yaw_rad: float = 0.0) -> Pose:
    """A planar pose (REP-103)."""
    half = 0.5 * yaw_rad
    return Pose(
        position=PointMsg(x=x, y=y, z=0.0),
        orientation=Quaternion(x=0.0, y=0.0, z=math.sin(half), w=math.cos(half)),
    )


def odometry_msg(
    pose: Pose2D, velocity: Point, stamp_ns: int, frame_id: str, child_frame_id: str
) -> Odometry:
    """The robot's pose in frame_id; velocity (odom frame, m/s) is given in the body frame."""
    message = Odometry(header=header(stamp_ns, frame_id), child_frame_id=child_frame_id)
    message.pose.pose = pose_msg(pose.x, pose.y, pose.yaw)
    linear = message.twist.twist.linear
    linear.x, linear.y = rotated(velocity, -pose.yaw)
    return message


def obstacles_msg(centers: Sequence[Point], stamp_ns: int, frame_id: str) -> PoseArray:
    """Obstacle centres, in scenario order."""
    return PoseArray(header=header(stamp_ns, frame_id), poses=[pose_msg(x, y) for x, y in centers])


def sectors_msg(
    ranges_m: Ranges, params: SensorParams, robot_radius_m: float, stamp_ns: int, frame_id: str
) -> LaserScan:
    """One beam per sector, through its middle; inf is free; intensities are a(i) of eq. 11."""
    width = 2.0 * math.pi / len(ranges_m)
    farthest = max(
        [longest_range_m(params, robot_radius_m), *(r for r in ranges_m if math.isfinite(r))]
    )
    return LaserScan(
        header=header(stamp_ns, frame_id),
        angle_min=0.5 * width,
        angle_max=2.0 * math.pi - 0.5 * width,
        angle_increment=width,
        range_min=0.0,
        range_max=farthest,
        ranges=ranges_m,
        intensities=[1.0 if math.isfinite(r) else 0.0 for r in ranges_m],
    )


def sensory_vector_msg(vs: Bits) -> UInt8MultiArray:
    """Vs of eq. 11 for people, bags and plots."""
    n = len(vs)
    dimension = MultiArrayDimension(label="sector", size=n, stride=n)
    return UInt8MultiArray(layout=MultiArrayLayout(dim=[dimension], data_offset=0), data=vs)


def pose_stamped_msg(point: Point, stamp_ns: int, frame_id: str) -> PoseStamped:
    """A goal or goal step."""
    return PoseStamped(header=header(stamp_ns, frame_id), pose=pose_msg(*point))


def path_msg(points: Sequence[Point], stamp_ns: int, frame_id: str) -> Path:
    """A polyline."""
    poses = [pose_stamped_msg(point, stamp_ns, frame_id) for point in points]
    return Path(header=header(stamp_ns, frame_id), poses=poses)


def plan_msg(decision: Decision, frame_id: str) -> Path:
    """Pose now, goal step, goal: what the planner means to do."""
    points = [decision.pose.position]
    if decision.waypoint != points[-1]:
        points.append(decision.waypoint)
    if decision.goal is not None and decision.goal != points[-1]:
        points.append(decision.goal)
    return path_msg(points, decision.stamp_ns, frame_id)


def twist_msg(decision: Decision) -> Twist:
    """The goal step as a velocity in the body frame (m/s)."""
    message = Twist()
    message.linear.x, message.linear.y = rotated(decision.velocity, -decision.pose.yaw)
    return message


def twist_stamped_msg(decision: Decision, frame_id: str) -> TwistStamped:
    """The same with a stamp, as Nav2's enable_stamped_cmd_vel."""
    return TwistStamped(header=header(decision.stamp_ns, frame_id), twist=twist_msg(decision))


_LEVELS = {
    Mode.BLOCKED: DiagnosticStatus.WARN,
    Mode.STOPPED: DiagnosticStatus.ERROR,
}


def decision_msg(decision: Decision, algorithm: str, refused: int, name: str) -> DiagnosticArray:
    """Why the planner did what it did; floats as text that gives back the same floats."""
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
        "algorithm": algorithm,
        "refused_inputs": str(refused),
    }
    status = DiagnosticStatus(
        level=_LEVELS.get(decision.mode, DiagnosticStatus.OK),
        name=name,
        message=decision.reason,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
    return DiagnosticArray(header=header(decision.stamp_ns, ""), status=[status])


def outcome_msg(outcome: Outcome | None, ticks: int) -> DiagnosticStatus:
    """How a run stands: None is running; ticks counts those published."""
    return DiagnosticStatus(
        name="run",
        message=outcome.value if outcome else "running",
        values=[KeyValue(key="ticks", value=str(ticks))],
    )
