# SPDX-License-Identifier: Apache-2.0
"""The planner's publishers: goal_step and cmd_vel, then plan, decision, markers, map."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from geometry_msgs.msg import Twist, TwistStamped

from ...core.geometry import Point
from ...core.planner_types import Decision, Mode
from ...planning.odometry_jump import is_odometry_jump
from ...planning.supervised_planner import SupervisedPlanner
from ..interface import markers, to_messages, topics
from ..interface.tick_serializers import CommandSerializer, GoalStepSerializer, PlanSerializer
from ..node_settings import PlannerSettings
from ..runtime.base_node import GraphNode
from .local_map_publisher import LocalMapPublisher


class PlannerPublishers:
    """The publishers of planner."""

    def __init__(
        self,
        node: GraphNode,
        settings: PlannerSettings,
        path_planner: Callable[[], SupervisedPlanner],
    ) -> None:
        """Advertise all topics; cmd_vel holds for one tick of the planner's params."""
        self._settings, self._path_planner = settings, path_planner
        self._log = node.get_logger()
        self._node_name = node.get_fully_qualified_name()
        self._serialized_goal_step = GoalStepSerializer(settings.odom_frame)
        self._serialized_command = CommandSerializer()
        self._serialized_plan = PlanSerializer(settings.odom_frame)
        self._goal_step = node.advertise(topics.GOAL_STEP)
        self._plan = node.advertise(topics.PLAN)
        self._decision = node.advertise(topics.DECISION)
        self._markers = node.advertise(topics.MARKERS)
        self._local_map = LocalMapPublisher(node, settings)
        self._view = markers.RateLimit(settings.view_period_s)
        stamped = TwistStamped if settings.enable_stamped_cmd_vel else None
        self._cmd_vel = node.advertise(topics.CMD_VEL, stamped)

    def publish_decision(
        self,
        decision: Decision,
        refused: int,
        goal_fields: Mapping[str, str],
        ring_radius_m: float,
    ) -> None:
        """Publish the command first, as the world waits for it, then the rest of the decision."""
        self.publish_command(decision)
        if decision.mode is Mode.STOPPED or is_odometry_jump(decision.reason):
            self._log.warning(decision.reason, throttle_duration_sec=1.0)
        frame = self._settings.odom_frame
        self._plan.publish(self._serialized_plan(decision))
        self._decision.publish(
            to_messages.decision_msg(
                decision, self._path_planner().params.label, refused, self._node_name, goal_fields
            )
        )
        if self._view.due(decision.stamp_ns):
            self._markers.publish(markers.decision_markers(decision, frame, ring_radius_m))
        self._local_map.publish_if_due(self._path_planner().local_map, decision.stamp_ns)

    def publish_command(self, decision: Decision) -> None:
        """Publish goal_step, then cmd_vel: the stamp of goal_step is also that of cmd_vel."""
        s, stamp, params = self._settings, decision.stamp_ns, self._path_planner().params
        self._goal_step.publish(self._serialized_goal_step(decision.waypoint, stamp))
        if s.enable_stamped_cmd_vel:
            twist = to_messages.twist_stamped_msg(decision, s.base_frame, params, params.tick_ns)
            self._cmd_vel.publish(twist)
        else:
            self._cmd_vel.publish(self._serialized_command(decision, params, params.tick_ns))

    def publish_stop(self, position: Point, stamp_ns: int) -> None:
        """Command rest at this position, without a decision."""
        s = self._settings
        self._goal_step.publish(self._serialized_goal_step(position, stamp_ns))
        if s.enable_stamped_cmd_vel:
            rest = TwistStamped()
            to_messages.set_header(rest.header, stamp_ns, s.base_frame)
            self._cmd_vel.publish(rest)
        else:
            self._cmd_vel.publish(Twist())
