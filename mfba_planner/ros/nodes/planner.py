# SPDX-License-Identifier: Apache-2.0
"""planner: answers odometry and sectors with a goal step, a path, a velocity and a reason."""

from __future__ import annotations

import time
from typing import Any

from ...core.errors import InputError
from ...core.geometry import Pose2D
from ...core.types import NANO, Decision, Mode, observe
from ...planning.planner_factory import make_planner
from ...planning.planner_params import PlannerParams
from ...planning.recovery import Phase
from ...recording.from_messages import robot_pose, sector_ranges, stamp_ns
from ..endpoints.goal_subscriptions import GoalSubscriptions
from ..endpoints.planner_diagnostics import PlannerHealth
from ..endpoints.planner_publishers import PlannerPublishers
from ..endpoints.scan_sync import ScanSync
from ..interface import parameters, topics
from ..node_parameters import PlannerSettings, names
from ..runtime.lifecycle_node import ManagedNode
from ..runtime.node_runtime import Refusals, spin_node
from ..runtime.stale_inputs import Lockstep, Newest, Ready, watch_period_s


class PlannerNode(ManagedNode):
    """Algorithm 1, or another method, as a node: convert, decide, convert."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.PLANNER, **kwargs)
        self.settings = s = parameters.declare(self, PlannerSettings(), read_only=True)
        self.path_planner = make_planner(parameters.declare(self, PlannerParams()), seed=s.seed)
        parameters.follow(self, lambda: self.path_planner.params, self._set_params)
        self._refusals = Refusals(self)
        self.goals = GoalSubscriptions(
            self, s.odom_frame, self._refusals, self._is_over, self._set_out
        )
        params_now = self.path_planner.params
        self._scan_sync = ScanSync(self, self._refusals, self._on_sectors, params_now, s.scan_yaw)
        self._health = PlannerHealth(self, s, self._refusals)
        self._forget()
        self.on_time_set_back(self._start_afresh)
        timeout_s = self.path_planner.params.input_timeout_s
        self.every(watch_period_s(timeout_s, lockstep=s.lockstep), self._watch)
        self.begin(s.autostart)
        self.advertise_ready(names(s.wait_for))

    def set_up(self) -> None:
        """Advertise and subscribe."""
        s = self.settings
        self._say = PlannerPublishers(self, s, lambda: self.path_planner.params.tick_ns)
        self.listen(topics.ODOM, self._on_odom, from_anyone=not s.lockstep)
        self._scan_sync.listen()
        self.goals.listen()

    def halt(self) -> None:
        """Command rest once: nobody will, from now on."""
        self._say.halt(self._pose.position, self._last.stamp_ns if self._last else 0)
        self.goals.goal_queue.begin_anew()
        self._forget()

    def tear_down(self) -> None:
        """Forget all but the parameters; be neither heard nor spoken to."""
        self.unsubscribe(keep=[topics.DIAGNOSTICS])
        self.goals.forget()
        self._forget()

    def close(self) -> None:
        """In real time, leave the robot at rest."""
        if self.is_active and not self.settings.lockstep:
            self.halt()

    def missing(self) -> str:
        """Besides the subscribers: the goal, when peers are waited for."""
        wanting = self._peers and not self.goals.goal_queue.goal
        return super().missing() or ("no goal_pose yet" if wanting else "")

    def _set_params(self, changed: PlannerParams) -> None:
        if changed.method is not self.path_planner.params.method:
            self.path_planner = make_planner(changed, seed=self.settings.seed)
        self.path_planner.params = changed

    def _start_afresh(self) -> None:
        self.get_logger().warning("time was set back: starting afresh")
        self._forget()

    def _forget(self) -> None:
        self.path_planner.reset()
        self._scan_sync.forget()
        self._pose = Pose2D(0.0, 0.0)  # the last that could be used
        self._last: Decision | None = None
        self._inputs: Lockstep | Newest = Lockstep() if self.settings.lockstep else Newest()

    def _set_out(self) -> None:
        self.path_planner.reset()

    def _is_over(self) -> bool:
        arrived = self._last is not None and self._last.mode is Mode.ARRIVED
        return arrived or self.path_planner.phase is Phase.GIVEN_UP

    def _on_odom(self, message: Any) -> None:
        self._take("odom", message, robot_pose, self._inputs.odom)

    def _on_sectors(self, message: Any) -> None:
        self._say.reach_m = message.range_max
        self._take("sectors", message, sector_ranges, self._inputs.sectors)

    def _take(self, name: str, message: Any, read: Any, add: Any) -> None:
        """Read one input and answer, if that completes what a decision needs."""
        stamp, now_s = stamp_ns(message.header.stamp), time.monotonic()
        try:
            value = read(message, self.settings.odom_frame)
        except InputError as error:
            self._refusals.add(error, name)
            value = str(error)
        try:
            ready = add(stamp, value, now_s)
        except InputError as error:
            self._refusals.add(error, name)
        else:
            self._health.heard(name, stamp, now_s, value if isinstance(value, str) else "")
            self._answer(ready)

    def _watch(self) -> None:
        """Say stop, again and again, while sectors or odom are stale; and how things are."""
        if isinstance(self._inputs, Newest):
            timeout_s = self.path_planner.params.input_timeout_s
            self._answer(self._inputs.stale(time.monotonic(), timeout_s))
        self._health.report(self._last, self.path_planner, self.goals.goal_queue, self.state)

    def _answer(self, ready: Ready | None) -> None:
        if ready is None or not self.is_active:
            return
        stamp, pose, ranges, age_s = ready
        if self.settings.lockstep and self._last and self._last.stamp_ns == stamp:
            self._say.move(self._last)  # asked again: that answer got lost, or is on its way
            return
        if self.settings.lockstep and self.goals.is_under_way():
            return  # restarted: the world asks again
        goal = self.goals.next_from(pose, self.path_planner.params.goal_tolerance_m)
        seen = observe(stamp, pose, ranges, goal, self._pose, round(age_s / NANO))
        self._pose = seen.pose
        self._last = decision = self.path_planner.plan(self._scan_sync.seen(seen))
        more = {
            "goal_id": str(self.goals.goal_queue.number),
            "goal_index": self.goals.goal_queue.leg,
        }
        self._say.decided(decision, self.path_planner.params.label, self._refusals.count, more)
        self._health.decided(decision, self.path_planner, self.goals.goal_queue, self.state)


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(PlannerNode, args)
