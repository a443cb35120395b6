# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show: obstacles, sensing ring, lit sectors, candidates; and tf."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ..core.episode import World
from ..core.geometry import Point, towards
from ..core.planner import NANO, Decision, Mode
from .convert import pose_msg, set_header

Rgba = tuple[float, float, float, float]

# Okabe and Ito's palette: told apart by everybody.
ORANGE: Rgba = (0.90, 0.62, 0.0, 0.9)
SKY: Rgba = (0.34, 0.71, 0.91, 0.9)
GREEN: Rgba = (0.0, 0.62, 0.45, 0.9)
VERMILION: Rgba = (0.84, 0.37, 0.0, 0.9)
GREY: Rgba = (0.5, 0.5, 0.5, 0.6)

MODE_COLORS = {
    Mode.IDLE: GREY,
    Mode.PATH_GENERATION: SKY,
    Mode.OBSTACLE_AVOIDANCE: ORANGE,
    Mode.BLOCKED: VERMILION,
    Mode.STOPPED: VERMILION,
    Mode.ARRIVED: GREEN,
}
ARROW_S = 2.0  # a velocity arrow shows where the obstacle will be after so long


class Seldom:
    """Viewers need no message per tick: says when a period of simulated time has passed."""

    def __init__(self, period_s: float) -> None:
        """The first stamp is due."""
        self._period_ns = round(period_s / NANO)
        self._last_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Whether to show something at this stamp; also when time was set back."""
        last = self._last_ns
        if last is not None and last <= stamp_ns < last + self._period_ns:
            return False
        self._last_ns = stamp_ns
        return True


def world_markers(world: World, stamp_ns: int, frame_id: str) -> MarkerArray:
    """Robot, goal, obstacles with their radii and velocity arrows."""
    robot_radius = world.scenario.robot_radius_m
    marks = [
        _disc("robot", 0, world.pose.position, robot_radius, SKY),
        _disc("goal", 0, world.scenario.goal_m, 0.5 * robot_radius, GREEN),
    ]
    now = world.scenario.centers(world.time_s)
    later = world.scenario.centers(world.time_s + ARROW_S)
    for number, (obstacle, a, b) in enumerate(zip(world.scenario.obstacles, now, later)):
        marks.append(_disc("obstacles", number, a, obstacle.radius_m, GREY))
        if a != b:
            marks.append(_line("velocities", number, [a, b], 0.05, VERMILION))
    return _array(marks, stamp_ns, frame_id)


def decision_markers(decision: Decision, frame_id: str) -> MarkerArray:
    """The lit sectors, the candidates and the step, in the colour of the mode."""
    color = MODE_COLORS[decision.mode]
    position = decision.pose.position
    marks = [_line("goal_step", 0, [position, decision.waypoint], 0.06, color)]
    marks.append(_points("candidates", 0, decision.candidates, GREEN))
    n = len(decision.ranges_m)
    width = 2.0 * math.pi / n if n else 0.0
    lit: list[Point] = []
    for i, r in enumerate(decision.ranges_m):
        if math.isfinite(r):
            edges = [towards(position, k * width, max(r, 0.05)) for k in (i, i + 1)]
            lit += [position, edges[0], edges[0], edges[1], edges[1], position]
    marks.append(_line("sectors", 0, lit, 0.03, ORANGE, kind=Marker.LINE_LIST))
    return _array(marks, decision.stamp_ns, frame_id)


def tf_msg(odom: Odometry) -> Any:
    """Odom -> base_link; only called where tf2_msgs is installed."""
    from tf2_msgs.msg import TFMessage

    p = odom.pose.pose.position
    transform = TransformStamped(
        header=odom.header,
        child_frame_id=odom.child_frame_id,
        transform=Transform(
            translation=Vector3(x=p.x, y=p.y, z=p.z), rotation=odom.pose.pose.orientation
        ),
    )
    return TFMessage(transforms=[transform])


def _array(marks: list[Marker], stamp_ns: int, frame_id: str) -> MarkerArray:
    head = set_header(Header(), stamp_ns, frame_id)
    for mark in marks:
        mark.header = head
    return MarkerArray(markers=marks)


def _disc(namespace: str, number: int, center: Point, radius: float, rgba: Rgba) -> Marker:
    return Marker(
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
    kind: int = Marker.LINE_STRIP,
) -> Marker:
    mark = _points(namespace, number, points, rgba)
    mark.type = kind
    mark.scale = Vector3(x=width, y=0.0, z=0.0)
    return mark


def _points(namespace: str, number: int, points: Sequence[Point], rgba: Rgba) -> Marker:
    """A list of points; one without any is deleted in the viewer, where it would be an error."""
    return Marker(
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
