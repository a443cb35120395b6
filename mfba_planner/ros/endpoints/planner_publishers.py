# SPDX-License-Identifier: Apache-2.0
"""What planner says: the move, and everything about the decision."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from geometry_msgs.msg import Twist, TwistStamped

from ...core.geometry import Point
from ...core.types import Decision, Mode
from ...planning.odometry_jump import is_jump_reason
from ..interface import markers, to_messages, topics
from ..node_parameters import PlannerSettings
from ..runtime.node_runtime import GraphNode


class PlannerPublishers:
    """The publishers of planner."""

    def __init__(
        self, node: GraphNode, settings: PlannerSettings, tick_ns: Callable[[], int]
    ) -> None:
        """Advertise them all; cmd_vel is what the base is told for a tick."""
        self._settings, self._tick_ns = settings, tick_ns
        self._log = node.get_logger()
        self._who = node.get_fully_qualified_name()
        self._goal_step = node.advertise(topics.GOAL_STEP)
        self._plan = node.advertise(topics.PLAN)
        self._decision = node.advertise(topics.DECISION)
        self._markers = node.advertise(topics.MARKERS)
        self.reach_m = 0.0  # of the sectors: what the ring shows
        self._view = markers.RateLimit(settings.view_period_s)
        stamped = TwistStamped if settings.enable_stamped_cmd_vel else None
        self._cmd_vel = node.advertise(topics.CMD_VEL, stamped)

    def decided(
        self, decision: Decision, algorithm: str, refused: int, more: Mapping[str, str]
    ) -> None:
        """What the world waits for first, everything about the decision while it moves on."""
        self.move(decision)
        if decision.mode is Mode.STOPPED or is_jump_reason(decision.reason):
            self._log.warning(decision.reason, throttle_duration_sec=1.0)
        frame = self._settings.odom_frame
        self._plan.publish(to_messages.plan_msg(decision, frame))
        reason = to_messages.decision_msg(decision, algorithm, refused, self._who, more)
        self._decision.publish(reason)
        if self._view.due(decision.stamp_ns):
            self._markers.publish(markers.decision_markers(decision, frame, self.reach_m))

    def move(self, decision: Decision) -> None:
        """Publish goal_step, then cmd_vel: the stamp of the one is the other's as well."""
        s, stamp, tick_ns = self._settings, decision.stamp_ns, self._tick_ns()
        self._goal_step.publish(
            to_messages.pose_stamped_msg(decision.waypoint, stamp, s.odom_frame)
        )
        if s.enable_stamped_cmd_vel:
            twist = to_messages.twist_stamped_msg(decision, s.base_frame, s, tick_ns)
            self._cmd_vel.publish(twist)
        else:
            self._cmd_vel.publish(to_messages.twist_msg(decision, s, tick_ns))

    def halt(self, place: Point, stamp_ns: int) -> None:
        """Command rest, here, without having decided anything."""
        s = self._settings
        self._goal_step.publish(to_messages.pose_stamped_msg(place, stamp_ns, s.odom_frame))
        if s.enable_stamped_cmd_vel:
            rest = TwistStamped()
            to_messages.set_header(rest.header, stamp_ns, s.base_frame)
            self._cmd_vel.publish(rest)
        else:
            self._cmd_vel.publish(Twist())
