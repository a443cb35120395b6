# SPDX-License-Identifier: Apache-2.0
"""planner: turns odometry and sectors into a goal step, a velocity, a path and a reason."""

from __future__ import annotations

from typing import Any

from ...core.geometry import Pose2D
from ...core.planner_types import NANO, Decision, Mode, Observation, observe
from ...planning.planner_factory import check_usable, make_loaded_planner
from ...planning.planner_params import PlannerParams
from ...planning.recovery import Phase
from ..endpoints.goal_subscriptions import GoalSubscriptions
from ..endpoints.input_subscriptions import InputSubscriptions
from ..endpoints.planner_diagnostics import PlannerDiagnostics
from ..endpoints.planner_publishers import PlannerPublishers
from ..interface import parameters, topics
from ..node_settings import PlannerSettings, names
from ..runtime.input_monitor import InputMonitor
from ..runtime.lifecycle_node import ManagedNode
from ..runtime.lockstep_inputs import Inputs
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.spin_node import spin_node
from ..runtime.stale_inputs import watch_period_s


class PlannerNode(ManagedNode):
    """Any path planner as a node; one tick: _on_inputs -> _perceive -> _plan -> _publish."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.PLANNER, **kwargs)
        self.settings = s = parameters.declare(self, PlannerSettings(), read_only=True)
        self.path_planner = make_loaded_planner(parameters.declare(self, PlannerParams()), s.seed)
        parameters.follow(self, lambda: self.path_planner.params, self._set_params, check_usable)
        params = self.path_planner.params
        self._refused_inputs = refused = RefusedInputs(self)
        self.goals = GoalSubscriptions(
            self, s.odom_frame, refused, self._is_finished, lambda: self.path_planner.reset()
        )
        monitor = InputMonitor(self, s, refused, params.input_timeout_s, self._on_time_set_back)
        self._diagnostics = PlannerDiagnostics(self, s, refused, monitor)
        self._inputs = InputSubscriptions(
            self, s, params, refused, monitor, self._diagnostics, self.goals.transforms,
            self._on_inputs,
        )  # fmt: skip
        self._reset()
        self._timer = self.create_wall_timer(self._watch_period_s(), self._on_timer)
        self.enter_life_cycle(s.autostart)
        self.advertise_ready(names(s.wait_for))

    def configure(self) -> None:
        """Advertise and subscribe."""
        s = self.settings
        self._outputs = PlannerPublishers(self, s, lambda: self.path_planner)
        self._inputs.subscribe()
        self.goals.subscribe()
        self.announce(self._inputs.text(self.path_planner.params))

    def deactivate(self) -> None:
        """Command rest once, as no command follows."""
        self._outputs.publish_stop(self._pose.position, self._last.stamp_ns if self._last else 0)
        self.goals.goal_queue.renew()
        self._reset()

    def clean_up(self) -> None:
        """Forget all but the parameters; destroy publishers and subscriptions."""
        self.unsubscribe(keep=[topics.DIAGNOSTICS])
        self._inputs.unsubscribed()
        self.goals.reset()
        self._reset()

    def close(self) -> None:
        """In real time, leave the robot at rest."""
        if self.is_active and not self.settings.lockstep:
            self.deactivate()

    def awaits(self) -> str:
        """The map, then the goal."""
        no_goal = "" if self.goals.goal_queue.goal else self.goals.awaited or "no goal_pose yet"
        return self._inputs.map.missing or no_goal

    def _reset(self) -> None:
        self.path_planner.reset()
        self._inputs.reset()
        self._pose = Pose2D(0.0, 0.0)  # the last that was not refused
        self._last: Decision | None = None

    def _set_params(self, changed: PlannerParams) -> None:
        if changed.method is not self.path_planner.params.method:
            self.path_planner = make_loaded_planner(changed, self.settings.seed)
        self.path_planner.params = changed
        self._inputs.set_params(changed)
        self._timer.timer_period_ns = round(self._watch_period_s() / NANO)

    def _watch_period_s(self) -> float:
        timeout_s = self.path_planner.params.input_timeout_s
        return watch_period_s(timeout_s, lockstep=self.settings.lockstep)

    def _is_finished(self) -> bool:
        arrived = self._last is not None and self._last.mode is Mode.ARRIVED
        return arrived or self.path_planner.phase is Phase.GIVEN_UP

    def _on_time_set_back(self) -> None:
        self.get_logger().warning("time was set back: reset")
        self._reset()

    def _on_timer(self) -> None:
        """Decide again while inputs are stale, which stops the robot; publish diagnostics."""
        stale = self._inputs.stale(self.path_planner.params.input_timeout_s)
        if stale is not None:
            self._on_inputs(stale)
        planner, goals = self.path_planner, self.goals.goal_queue
        self._diagnostics.publish(self._last, planner, goals, self.state)

    def _on_inputs(self, inputs: Inputs) -> None:
        """One tick."""
        if not self.is_active:
            return
        if self.settings.lockstep and self._last and self._last.stamp_ns == inputs.stamp_ns:
            self._outputs.publish_command(self._last)  # a repeated tick: the command may be lost
            return
        if self.settings.lockstep and self.goals.is_expected():
            return  # just started: world_sim repeats the tick
        self._publish(self._plan(self._perceive(inputs)))

    def _perceive(self, inputs: Inputs) -> Observation:
        stamp, pose, ranges, age_s = inputs[:4]
        goal = self.goals.advance(pose, self.path_planner.params.goal_tolerance_m)
        observation = observe(stamp, pose, ranges, goal, self._pose, round(age_s / NANO))
        self._pose = observation.pose
        return self._inputs.add_scan(observation, inputs)

    def _plan(self, observation: Observation) -> Decision:
        self.path_planner.set_known_map(self._inputs.map.known_map)
        self._last = self.path_planner.plan(observation)
        return self._last

    def _publish(self, decision: Decision) -> None:
        planner, goals = self.path_planner, self.goals.goal_queue
        fields = {**goals.fields, **self._inputs.fields}
        ring_m, refused = self._inputs.range_max_m, self._refused_inputs.count
        self._outputs.publish_decision(decision, refused, fields, ring_m)
        self._diagnostics.decision_made(decision, planner, goals, self.state)


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(PlannerNode, args)
