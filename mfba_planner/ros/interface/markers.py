# SPDX-License-Identifier: Apache-2.0
"""Markers for RViz and Foxglove: obstacles, and the robot's ring, sectors and gap; and tf."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from copy import copy
from typing import Any

from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry, Path
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ...core.geometry import Point, bearing, quaternion_from_yaw, towards
from ...core.planner_types import NANO, Decision, Mode, Ranges
from ...simulation.robot_model import Lidar
from ...simulation.world import World
from .to_messages import pose_msg, set_header, set_pose

Rgba = tuple[float, float, float, float]

# Okabe and Ito's palette, for any colour vision.
ORANGE: Rgba = (0.90, 0.62, 0.0, 0.9)
SKY: Rgba = (0.34, 0.71, 0.91, 0.9)
GREEN: Rgba = (0.0, 0.62, 0.45, 0.9)
VERMILION: Rgba = (0.84, 0.37, 0.0, 0.9)
GREY: Rgba = (0.5, 0.5, 0.5, 0.6)
DARK: Rgba = (0.13, 0.13, 0.13, 1.0)
FAINT: Rgba = (0.90, 0.62, 0.0, 0.25)
RING, SLICES = 72, 4  # corners of the ring, triangles of a sector

MODE_COLORS = {
    Mode.IDLE: GREY,
    Mode.PATH_GENERATION: SKY,
    Mode.OBSTACLE_AVOIDANCE: ORANGE,
    Mode.BLOCKED: VERMILION,
    Mode.STOPPED: VERMILION,
    Mode.ARRIVED: GREEN,
}
TRAIL_POINTS = 500  # one per view period; of a longer trail the newest is shown
ARROW_S = 2.0  # a velocity arrow ends where the obstacle will be after this time


class RateLimit:
    """Whether a period of simulated time has passed: viewers need no message per tick."""

    def __init__(self, period_s: float) -> None:
        """The first stamp is due."""
        self._period_ns = round(period_s / NANO)
        self._last_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Whether to publish at this stamp; True also when time was set back."""
        last = self._last_ns
        if last is not None and last <= stamp_ns < last + self._period_ns:
            return False
        self._last_ns = stamp_ns
        return True


class Trail:
    """The newest positions as a Path; all its poses have the header of the newest."""

    def __init__(self, frame_id: str) -> None:
        """Start without a position."""
        self._path = Path()
        self._path.header.frame_id = frame_id
        self._poses: deque[PoseStamped] = deque(maxlen=TRAIL_POINTS)

    def clear(self) -> None:
        """Forget all positions."""
        self._poses.clear()

    def add(self, position: Point, stamp_ns: int) -> Path:
        """Add a position; the message is the same object every time."""
        header = set_header(self._path.header, stamp_ns, self._path.header.frame_id)
        pose = PoseStamped()
        pose.header = header  # shared, and so of the newest stamp
        set_pose(pose.pose, *position)
        self._poses.append(pose)
        self._path.poses = list(self._poses)
        return self._path


def world_markers(world: World, stamp_ns: int, frame_id: str) -> MarkerArray:
    """Robot, goal, wall segments, obstacles with their radii and velocity arrows."""
    robot_radius = world.scenario.robot_radius_m
    marks = [
        *(
            _disc("robot", number, center, radius, SKY)
            for number, (center, radius) in enumerate(world.scenario.robot_circles(world.pose))
        ),
        _disc("goal", 0, world.scenario.goal_m, 0.5 * robot_radius, GREEN),
    ]
    now = world.scenario.centers(world.time_s)
    later = world.scenario.centers(world.time_s + ARROW_S)
    for number, (obstacle, a, b) in enumerate(zip(world.scenario.obstacles, now, later)):
        if math.isnan(a[0]):  # absent: take away what was drawn of it
            marks += [_deleted(namespace, number) for namespace in ("obstacles", "velocities")]
            continue
        marks.append(_disc("obstacles", number, a, obstacle.radius_m, GREY))
        if a != b and not math.isnan(b[0]):
            marks.append(_arrow("velocities", number, [a, b], VERMILION))
    ends = [
        (x, y) for x0, y0, x1, y1 in world.scenario.segments_m for x, y in ((x0, y0), (x1, y1))
    ]
    marks.append(_line("walls", 0, ends, 0.05, DARK, Marker.LINE_LIST))
    return _array(marks, stamp_ns, frame_id)


def decision_markers(decision: Decision, frame_id: str, ring_radius_m: float) -> MarkerArray:
    """Mode, ring, sectors, gap, candidates and goal step around the robot."""
    color = MODE_COLORS[decision.mode]
    position, waypoint = decision.pose.position, decision.waypoint
    n = len(decision.ranges_m)
    reach_m = ring_radius_m if math.isfinite(ring_radius_m) else 0.0
    ring = [towards(position, k * math.tau / RING, reach_m) for k in range(RING + 1)]
    ahead = towards(position, bearing(position, waypoint), reach_m)
    vx, vy = decision.velocity
    tip = (position[0] + vx, position[1] + vy)
    marks = [
        _line("ring", 0, ring if reach_m else [], 0.03, color),
        _line("spokes", 0, _spokes(position, n, reach_m), 0.01, GREY, Marker.LINE_LIST),
        _fan("lit", position, decision.ranges_m, reach_m),
        _line("sectors", 0, _outlines(decision), 0.03, ORANGE, Marker.LINE_LIST),
        _arrow("gap", 0, [position, ahead] if decision.gap else [], GREEN),
        _arrow("velocity", 0, [position, tip] if tip != position else [], color),
        _line("goal_step", 0, [position, waypoint], 0.06, color),
        _points("candidates", 0, decision.candidates, GREEN),
        _text("mode", position, decision.mode.value.replace("_", " "), color),
    ]
    return _array(marks, decision.stamp_ns, frame_id)


def _spokes(position: Point, n: int, reach_m: float) -> list[Point]:
    """The boundaries of all sectors."""
    ends = [towards(position, k * math.tau / n, reach_m) for k in range(n)] if reach_m else []
    return [point for end in ends for point in (position, end)]


def _outlines(decision: Decision) -> list[Point]:
    """Each set sector as far as it is free."""
    position, lit = decision.pose.position, []
    width = math.tau / max(len(decision.ranges_m), 1)
    for i, r in enumerate(decision.ranges_m):
        if math.isfinite(r):
            a, b = (towards(position, k * width, max(r, 0.05)) for k in (i, i + 1))
            lit += [position, a, a, b, b, position]
    return lit


def _fan(namespace: str, position: Point, ranges_m: Ranges, reach_m: float) -> Marker:
    """The area of all set sectors, out to the ring."""
    corners: list[Point] = []
    width = math.tau / max(len(ranges_m), 1)
    for i, r in enumerate(ranges_m):
        for k in range(SLICES if math.isfinite(r) and reach_m else 0):
            a, b = (towards(position, (i + (k + e) / SLICES) * width, reach_m) for e in (0, 1))
            corners += [position, a, b]
    mark = _points(namespace, 0, corners, FAINT)
    mark.type, mark.scale = Marker.TRIANGLE_LIST, Vector3(x=1.0, y=1.0, z=1.0)
    return mark


def tf_msg(odom: Odometry) -> Any:
    """Odom -> base_link; only called where tf2_msgs is installed."""
    p = odom.pose.pose.position
    place = Vector3(x=p.x, y=p.y, z=p.z)
    return _tf_message(odom.header, odom.child_frame_id, place, odom.pose.pose.orientation)


def lidar_tf_msg(lidar: Lidar, base_frame: str, scan_frame: str) -> Any:
    """Base_link -> base_scan; only called where tf2_msgs is installed."""
    s, c = quaternion_from_yaw(lidar.yaw_rad)
    place = Vector3(x=lidar.x_m, y=lidar.y_m, z=0.0)
    rotation = Quaternion(x=c, y=s, w=0.0) if lidar.flipped else Quaternion(z=s, w=c)
    return _tf_message(Header(frame_id=base_frame), scan_frame, place, rotation)


def _tf_message(header: Header, frame: str, place: Vector3, rotation: Quaternion) -> Any:
    from tf2_msgs.msg import TFMessage

    pose = Transform(translation=place, rotation=rotation)
    transform = TransformStamped(header=header, child_frame_id=frame, transform=pose)
    return TFMessage(transforms=[transform])


def _array(marks: list[Marker], stamp_ns: int, frame_id: str) -> MarkerArray:
    head = set_header(Header(), stamp_ns, frame_id)
    for mark in marks:
        mark.header = head
    return MarkerArray(markers=marks)


def _marker(**fields: Any) -> Marker:
    """A Marker; what is not given is shared with all others, and never changed."""
    mark = copy(_BLANK)
    for name, value in fields.items():
        setattr(mark, name, value)
    return mark


_BLANK = Marker()  # copied, as constructing one takes four times as long


def _deleted(namespace: str, number: int) -> Marker:
    return _marker(ns=namespace, id=number, action=Marker.DELETE)


def _disc(namespace: str, number: int, center: Point, radius: float, rgba: Rgba) -> Marker:
    return _marker(
        ns=namespace,
        id=number,
        type=Marker.CYLINDER,
        pose=pose_msg(*center),
        scale=Vector3(x=2.0 * radius, y=2.0 * radius, z=0.1),
        color=_color(rgba),
    )


def _line(
    namespace: str,
    number: int,
    points: Sequence[Point],
    width: float,
    rgba: Rgba,
    marker_type: int = Marker.LINE_STRIP,
) -> Marker:
    mark = _points(namespace, number, points, rgba)
    mark.type = marker_type
    mark.scale = Vector3(x=width, y=0.0, z=0.0)
    return mark


def _arrow(namespace: str, number: int, points: Sequence[Point], rgba: Rgba) -> Marker:
    """An arrow from the first to the second of two points; none without points."""
    mark = _points(namespace, number, points, rgba)
    mark.type, mark.scale = Marker.ARROW, Vector3(x=0.05, y=0.12, z=0.12)
    return mark


def _text(namespace: str, position: Point, text: str, rgba: Rgba) -> Marker:
    """A label above a position, facing the viewer."""
    mark = _disc(namespace, 0, position, 0.0, rgba)
    mark.type, mark.text = Marker.TEXT_VIEW_FACING, text
    mark.pose.position.z, mark.scale = 0.5, Vector3(x=0.0, y=0.0, z=0.2)
    return mark


def _points(namespace: str, number: int, points: Sequence[Point], rgba: Rgba) -> Marker:
    """A list of points; an empty one is deleted, as viewers report it as an error."""
    return _marker(
        ns=namespace,
        id=number,
        type=Marker.POINTS,
        action=Marker.ADD if points else Marker.DELETE,
        pose=pose_msg(0.0, 0.0),
        scale=Vector3(x=0.05, y=0.05, z=0.0),
        color=_color(rgba),
        points=[PointMsg(x=x, y=y, z=0.0) for x, y in points],
    )


def _color(rgba: Rgba) -> ColorRGBA:
    r, g, b, a = rgba
    return ColorRGBA(r=r, g=g, b=b, a=a)
