# SPDX-License-Identifier: Apache-2.0
"""The messages of every tick, serialized: equal to to_messages.py's, in a tenth of the time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...core.geometry import Point, Pose2D, quaternion_from_yaw, rotated
from ...core.planner_types import Bits, Decision, Ranges
from ...core.robot_base import Base
from ...perception.sensory_vector import SensorParams, longest_range_m
from ...recording.from_messages import SECOND_NS, body_velocity
from . import to_messages
from .message_template import MessageTemplate

_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_NONE = Pose2D(0.0, 0.0)


class ClockSerializer:
    """/clock."""

    def __init__(self) -> None:
        self._template = MessageTemplate(to_messages.clock_msg(0), ("clock.sec", "clock.nanosec"))

    def __call__(self, stamp_ns: int) -> bytes:
        """As to_messages.clock_msg()."""
        return self._template.fill(divmod(stamp_ns, SECOND_NS))


class OdometrySerializer:
    """Odometry in fixed frames."""

    def __init__(self, frame_id: str, child_frame_id: str) -> None:
        self._template = MessageTemplate(
            to_messages.odometry_msg(_NONE, (0.0, 0.0), 0, frame_id, child_frame_id),
            (
                *_STAMP,
                *_fields("pose.pose.position", "xy"),
                *_fields("pose.pose.orientation", "zw"),
                *_fields("twist.twist.linear", "xy"),
                "twist.twist.angular.z",
            ),
        )

    def __call__(
        self, pose: Pose2D, velocity: Point, stamp_ns: int, yaw_rate_radps: float = 0.0
    ) -> bytes:
        """As to_messages.odometry_msg()."""
        x, y, yaw = pose
        return self._template.fill(
            (
                *divmod(stamp_ns, SECOND_NS),
                x,
                y,
                *(quaternion_from_yaw(yaw) if yaw else (0.0, 1.0)),
                *rotated(velocity, -yaw),
                yaw_rate_radps,
            )
        )


class ObstaclesSerializer:
    """The centres of the obstacles that are there."""

    def __init__(self, frame_id: str) -> None:
        self._frame_id = frame_id
        self._templates: dict[int, MessageTemplate] = {}  # by number of obstacles

    def __call__(self, centers: Sequence[Point], stamp_ns: int) -> bytes:
        """As to_messages.obstacles_msg()."""
        count = len(centers)
        template = self._templates.get(count)
        if template is None:
            template = self._templates[count] = MessageTemplate(
                to_messages.obstacles_msg([(0.0, 0.0)] * count, 0, self._frame_id),
                (
                    *_STAMP,
                    *(f"poses.{k}.position.{axis}" for k in range(count) for axis in "xy"),
                ),
            )
        return template.fill(
            [*divmod(stamp_ns, SECOND_NS), *(value for center in centers for value in center)]
        )


class SectorsSerializer:
    """The ring of virtual sensors."""

    def __init__(self, frame_id: str) -> None:
        self._frame_id = frame_id
        self._templates: dict[int, MessageTemplate] = {}  # by number of sectors

    def __call__(
        self, ranges_m: Ranges, params: SensorParams, robot_radius_m: float, stamp_ns: int
    ) -> bytes:
        """As to_messages.sectors_msg()."""
        count = len(ranges_m)
        template = self._templates.get(count)
        if template is None:
            template = self._templates[count] = MessageTemplate(
                to_messages.sectors_msg(ranges_m, params, robot_radius_m, 0, self._frame_id),
                (*_STAMP, "range_max", "ranges", "intensities"),
            )
        finite = [math.isfinite(r) for r in ranges_m]
        longest = max(
            (r for r, is_finite in zip(ranges_m, finite) if is_finite), default=-math.inf
        )
        return template.fill(
            [
                *divmod(stamp_ns, SECOND_NS),
                max(longest_range_m(params, robot_radius_m), longest),
                *ranges_m,
                *finite,
            ]
        )


class SensoryVectorSerializer:
    """Vs of eq. 11."""

    def __init__(self) -> None:
        self._templates: dict[int, MessageTemplate] = {}  # by number of sectors

    def __call__(self, vs: Bits) -> bytes:
        """As to_messages.sensory_vector_msg()."""
        template = self._templates.get(len(vs))
        if template is None:
            template = self._templates[len(vs)] = MessageTemplate(
                to_messages.sensory_vector_msg(vs), ("data",)
            )
        return template.fill(vs)


class GoalStepSerializer:
    """A point with a stamp."""

    def __init__(self, frame_id: str) -> None:
        self._template = MessageTemplate(
            to_messages.pose_stamped_msg((0.0, 0.0), 0, frame_id),
            (*_STAMP, *_fields("pose.position", "xy")),
        )

    def __call__(self, point: Point, stamp_ns: int) -> bytes:
        """As to_messages.pose_stamped_msg()."""
        return self._template.fill((*divmod(stamp_ns, SECOND_NS), *point))


class CommandSerializer:
    """cmd_vel without a stamp."""

    def __init__(self) -> None:
        self._template = MessageTemplate(
            to_messages.Twist(), (*_fields("linear", "xy"), "angular.z")
        )

    def __call__(self, decision: Decision, base: Base, tick_ns: int) -> bytes:
        """As to_messages.twist_msg()."""
        return self._template.fill(body_velocity(decision, base, tick_ns))


class PlanSerializer:
    """The polyline from the pose over the goal step to the goal."""

    def __init__(self, frame_id: str) -> None:
        self._frame_id = frame_id
        self._templates: dict[int, MessageTemplate] = {}  # by number of points

    def __call__(self, decision: Decision) -> bytes:
        """As to_messages.plan_msg()."""
        points = to_messages.plan_points(decision)
        count = len(points)
        template = self._templates.get(count)
        if template is None:
            template = self._templates[count] = MessageTemplate(
                to_messages.path_msg([(0.0, 0.0)] * count, 0, self._frame_id),
                (*_STAMP, *(field for k in range(count) for field in _of_pose(k))),
            )
        stamp = divmod(decision.stamp_ns, SECOND_NS)
        return template.fill([*stamp, *(value for point in points for value in (*stamp, *point))])


def _fields(owner: str, names: str) -> tuple[str, ...]:
    return tuple(f"{owner}.{name}" for name in names)


def _of_pose(number: int) -> list[str]:
    return [f"poses.{number}.{name}" for name in (*_STAMP, *_fields("pose.position", "xy"))]
