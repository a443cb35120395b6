# SPDX-License-Identifier: Apache-2.0
"""planner: answers odometry and sectors with a goal step, a path, a velocity and a reason."""

from __future__ import annotations

import math
import time
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration

from ..core.errors import InputError
from ..core.geometry import Point, Pose2D
from ..core.planner import NANO, Decision, Mode, Observation, Planner, PlannerParams
from ..core.sensing import Ranges
from ..messages import goal_point, robot_pose, sector_ranges, stamp_ns
from . import convert, markers, params, topics
from .pairing import StampPairs
from .runtime import GraphNode, Refusals, spin_node
from .settings import PlannerSettings, names

Refused = str  # an input that was refused travels as its reason


class PlannerNode(GraphNode):
    """Algorithm 1 as a node: convert, decide, convert."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.PLANNER, **kwargs)
        self.settings = s = params.declare(self, PlannerSettings(), read_only=True)
        self.brain = Planner(params.declare(self, PlannerParams()), s.seed)
        params.follow(self, lambda: self.brain.params, self._set_params)
        self._refusals = Refusals(self)
        self._reset_inputs()
        self._goal: Point | None = None
        self._goal_message: Any = None
        self._pose, self._ranges = Pose2D(0.0, 0.0), (math.inf,) * 12  # the last usable ones
        self._next_view_ns = 0
        self._goal_step = self.advertise(topics.GOAL_STEP)
        self._plan = self.advertise(topics.PLAN)
        self._decision = self.advertise(topics.DECISION)
        self._markers = self.advertise(topics.MARKERS)
        kind = TwistStamped if s.enable_stamped_cmd_vel else None
        self._cmd_vel = self.advertise(topics.CMD_VEL, kind)
        self.listen(topics.ODOM, self._on_odom)
        self.listen(topics.SECTORS, self._on_sectors)
        self.listen(topics.GOAL_POSE, self._on_goal)
        self.offer_ready(names(s.wait_for))
        self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
            ),
            post_callback=self._on_time_jump,
        )
        if not s.lockstep:
            period = 0.25 * self.brain.params.input_timeout_s
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            self.create_timer(period, self._watch, clock=steady)

    def missing(self) -> str:
        """Besides the subscribers: the goal, when peers are waited for."""
        return super().missing() or ("no goal_pose yet" if self._peers and not self._goal else "")

    def _set_params(self, changed: PlannerParams) -> None:
        self.brain.params = changed

    def _reset_inputs(self) -> None:
        self._pairs: StampPairs[Pose2D | Refused, Ranges | Refused] = StampPairs()
        self._odom: tuple[Pose2D | Refused, float] | None = None
        self._sectors_at, self._last_stamp_ns = time.monotonic(), -1

    def _on_time_jump(self, _: TimeJump) -> None:
        self.get_logger().warning("time was set back: starting afresh")
        self.brain.reset()
        self._reset_inputs()

    def _on_goal(self, message: Any) -> None:
        if message == self._goal_message and stamp_ns(message.header.stamp):
            return  # a latched one, delivered twice
        self._goal_message = message
        self.brain.reset()
        try:
            self._goal = goal_point(message)
        except InputError as error:
            self._goal = None
            self._refusals.add(error)

    def _on_odom(self, message: Any) -> None:
        pose = self._read(robot_pose, message)
        self._odom = (pose, time.monotonic())
        if self.settings.lockstep:
            self._join(self._pairs.add_a, message, pose)

    def _on_sectors(self, message: Any) -> None:
        ranges = self._read(sector_ranges, message)
        self._sectors_at = time.monotonic()
        if self.settings.lockstep:
            self._join(self._pairs.add_b, message, ranges)
        elif self._is_newer(stamp_ns(message.header.stamp)):
            pose, arrived = self._odom or ("no odom yet", self._sectors_at)
            self._answer(self._last_stamp_ns, pose, ranges, self._sectors_at - arrived)

    def _read(self, reader: Any, message: Any) -> Any:
        """The message's value, or the reason why it was refused (and counted)."""
        try:
            return reader(message)
        except InputError as error:
            self._refusals.add(error)
            return str(error)

    def _join(self, add: Any, message: Any, value: Any) -> None:
        stamp = stamp_ns(message.header.stamp)
        try:
            pair = add(stamp, value)
        except InputError as error:
            self._refusals.add(error)
            return
        if pair is not None:
            pose, ranges = pair
            self._answer(stamp, pose, ranges, 0.0)

    def _is_newer(self, stamp: int) -> bool:
        if stamp > self._last_stamp_ns:
            self._last_stamp_ns = stamp
            return True
        self._refusals.add(InputError(f"sectors stamp {stamp} ns goes back; stamps must rise"))
        return False

    def _watch(self) -> None:
        """Real time: say stop, again and again, while sectors or odom are stale."""
        now = time.monotonic()
        age_s = now - min(self._sectors_at, self._odom[1] if self._odom else now)
        if age_s > self.brain.params.input_timeout_s and self._last_stamp_ns >= 0:
            pose, _ = self._odom or ("no odom yet", now)
            self._answer(self._last_stamp_ns, pose, self._ranges, age_s)

    def _answer(
        self, stamp: int, pose: Pose2D | Refused, ranges: Ranges | Refused, age_s: float
    ) -> None:
        refused = next((x for x in (pose, ranges) if isinstance(x, str)), "")
        if not isinstance(pose, str):
            self._pose = pose
        if not isinstance(ranges, str):
            self._ranges = ranges
        decision = self.brain.decide(
            Observation(
                stamp_ns=stamp,
                pose=self._pose,
                ranges_m=() if isinstance(ranges, str) else ranges,
                goal=self._goal,
                now_ns=stamp + round(age_s / NANO),
                refused=refused,
            )
        )
        if decision.mode is Mode.STOPPED:
            self.get_logger().warning(decision.reason, throttle_duration_sec=1.0)
        self._publish(decision)

    def _publish(self, decision: Decision) -> None:
        """Everything about the decision first, cmd_vel last: it is what the world waits for."""
        s, stamp = self.settings, decision.stamp_ns
        algorithm = self.brain.params.bat.algorithm.value
        self._goal_step.publish(convert.pose_stamped_msg(decision.waypoint, stamp, s.odom_frame))
        self._plan.publish(convert.plan_msg(decision, s.odom_frame))
        self._decision.publish(
            convert.decision_msg(
                decision, algorithm, self._refusals.count, self.get_fully_qualified_name()
            )
        )
        if stamp >= self._next_view_ns:
            self._next_view_ns = stamp + round(s.view_period_s / NANO)
            self._markers.publish(markers.decision_markers(decision, s.odom_frame))
        if s.enable_stamped_cmd_vel:
            self._cmd_vel.publish(convert.twist_stamped_msg(decision, s.base_frame))
        else:
            self._cmd_vel.publish(convert.twist_msg(decision))


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(PlannerNode, args)
