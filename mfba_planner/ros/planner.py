# SPDX-License-Identifier: Apache-2.0
"""planner: answers odometry and sectors with a goal step, a path, a velocity and a reason."""

from __future__ import annotations

import time
from typing import Any

from ..core.errors import InputError
from ..core.geometry import Point, Pose2D
from ..core.jump import carried_off
from ..core.planner import NANO, Decision, Mode, PlannerParams, observe
from ..messages import goal_point, robot_pose, sector_ranges, stamp_ns
from ..node_settings import PlannerSettings, names
from ..planners.method import brain
from . import convert, markers, params, topics
from .cmd_vel import CmdVel
from .inputs import Lockstep, Newest, Ready
from .runtime import GraphNode, Refusals, spin_node
from .sight import Sight


class PlannerNode(GraphNode):
    """Algorithm 1, or another method, as a node: convert, decide, convert."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.PLANNER, **kwargs)
        self.settings = s = params.declare(self, PlannerSettings(), read_only=True)
        self.brain = brain(params.declare(self, PlannerParams()), seed=s.seed)
        params.follow(self, lambda: self.brain.params, self._set_params)
        self._refusals = Refusals(self)
        self._goal: Point | None = None
        self._heard_goal = False
        self._pose = Pose2D(0.0, 0.0)  # the last that could be used
        self._last: Decision | None = None
        self._goal_step = self.advertise(topics.GOAL_STEP)
        self._plan = self.advertise(topics.PLAN)
        self._decision = self.advertise(topics.DECISION)
        self._markers = self.advertise(topics.MARKERS)
        self._view = markers.Seldom(s.view_period_s)
        self._cmd_vel = CmdVel(self, s)
        self._inputs: Lockstep | Newest = Lockstep() if s.lockstep else Newest()
        self.listen(topics.ODOM, self._on_odom, from_anyone=not s.lockstep)
        yaw = s.scan_yaw if self.brain.params.tracks_scan else None
        self._sight = Sight(self, self._refusals, self._on_sectors, yaw)
        self.listen(topics.GOAL_POSE, self._on_goal)
        self.offer_ready(names(s.wait_for))
        self.on_time_set_back(self._start_afresh)
        if not s.lockstep:
            period_s = min(max(0.25 * self.brain.params.input_timeout_s, 0.02), 0.25)
            self.every(period_s, self._watch)

    def missing(self) -> str:
        """Besides the subscribers: the goal, when peers are waited for."""
        return super().missing() or ("no goal_pose yet" if self._peers and not self._goal else "")

    def _set_params(self, changed: PlannerParams) -> None:
        if changed.method is not self.brain.params.method:
            self.brain = brain(changed, seed=self.settings.seed)
        self.brain.params = changed

    def _start_afresh(self) -> None:
        self.get_logger().warning("time was set back: starting afresh")
        self.brain.reset()
        self._last = None
        self._inputs = type(self._inputs)()
        self._sight.forget()

    def _on_goal(self, message: Any) -> None:
        self.brain.reset()
        self._goal, self._heard_goal = None, True
        frame, ours = message.header.frame_id, self.settings.odom_frame
        if frame not in ("", ours):
            self.get_logger().warning(f"goal_pose is in frame {frame!r}: taken as {ours!r}")
        try:
            self._goal = goal_point(message)
        except InputError as error:
            self._refusals.add(error)

    def _on_odom(self, message: Any) -> None:
        self._take(message, robot_pose, self._inputs.odom)

    def _on_sectors(self, message: Any) -> None:
        self._take(message, sector_ranges, self._inputs.sectors)

    def _take(self, message: Any, read: Any, add: Any) -> None:
        """Read one input and answer, if that completes what a decision needs."""
        try:
            value = read(message)
        except InputError as error:
            self._refusals.add(error)
            value = str(error)
        try:
            ready = add(stamp_ns(message.header.stamp), value, time.monotonic())
        except InputError as error:
            self._refusals.add(error)
        else:
            self._answer(ready)

    def _watch(self) -> None:
        """Real time: say stop, again and again, while sectors or odom are stale."""
        if isinstance(self._inputs, Newest):
            self._answer(self._inputs.stale(time.monotonic(), self.brain.params.input_timeout_s))

    def _answer(self, ready: Ready | None) -> None:
        if ready is None:
            return
        stamp, pose, ranges, age_s = ready
        if self.settings.lockstep and self._last and self._last.stamp_ns == stamp:
            self._move(self._last)  # asked again: that answer got lost, or is on its way
            return
        if self.settings.lockstep and self._goal_is_under_way():
            return  # restarted: the world asks again
        seen = observe(stamp, pose, ranges, self._goal, self._pose, round(age_s / NANO))
        self._pose = seen.pose
        decision = self.brain.plan(self._sight.seen(seen))
        if decision.mode is Mode.STOPPED or carried_off(decision.reason):
            self.get_logger().warning(decision.reason, throttle_duration_sec=1.0)
        self._last = decision
        self._publish(decision)

    def _goal_is_under_way(self) -> bool:
        """Whether somebody gives goals, of which a planner this young has not heard the last."""
        return not self._heard_goal and self.count_publishers(topics.GOAL_POSE.name) > 0

    def _publish(self, decision: Decision) -> None:
        """What the world waits for first, everything about the decision while it moves on."""
        self._move(decision)
        s, stamp = self.settings, decision.stamp_ns
        who, algorithm = self.get_fully_qualified_name(), self.brain.params.label
        self._plan.publish(convert.plan_msg(decision, s.odom_frame))
        reason = convert.decision_msg(decision, algorithm, self._refusals.count, who)
        self._decision.publish(reason)
        if self._view.due(stamp):
            self._markers.publish(markers.decision_markers(decision, s.odom_frame))

    def _move(self, decision: Decision) -> None:
        """Publish goal_step, then cmd_vel: the stamp of the one is the other's as well."""
        s, stamp = self.settings, decision.stamp_ns
        self._goal_step.publish(convert.pose_stamped_msg(decision.waypoint, stamp, s.odom_frame))
        self._cmd_vel.publish(decision, self.brain.params.tick_ns)


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(PlannerNode, args)
