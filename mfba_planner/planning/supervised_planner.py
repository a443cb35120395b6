# SPDX-License-Identifier: Apache-2.0
"""Wraps any planner with the optional speed limit near obstacles and the optional recovery."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from ..core.errors import ConfigError
from ..core.geometry import Point, bearing, distance, towards
from ..core.planner_types import NANO, Decision, Mode, Observation, PathPlanner
from .algorithm_1 import Algorithm1
from .odometry_jump import is_odometry_jump
from .planner_params import Method, PlannerParams
from .recovery import Phase, Recovery, advance, most_room
from .speed_limit import allowed_speed_share

TRAIL_STEP_M = 0.05  # least distance of two remembered positions
_NOT_DRIVING = (Mode.IDLE, Mode.ARRIVED)


class Resettable(PathPlanner, Protocol):
    """A planner with parameters and reset()."""

    params: PlannerParams

    def reset(self) -> None:
        """Drop all state but parameters and seed."""
        ...


class SupervisedPlanner:
    """Passes the decisions of a planner on, changed only by the options below.

    With recovery.enabled, BLOCKED decisions go through the phases of planning.recovery. With
    speed_limit.slow_within_m, velocities are reduced near obstacles. All depends only on the
    observations, so a recording reproduces the decisions.
    """

    def __init__(self, inner: Resettable) -> None:
        """Wrap a planner."""
        self.inner = inner
        self._forget()

    @property
    def params(self) -> PlannerParams:
        """The parameters of the wrapped planner."""
        return self.inner.params

    @params.setter
    def params(self, changed: PlannerParams) -> None:
        self.inner.params = changed

    @property
    def phase(self) -> Phase:
        """Phase of the recovery."""
        return self._recovery.phase

    def reset(self) -> None:
        """Drop all state but parameters and seed (after a clock reset, before a new trip)."""
        self.inner.reset()
        self._forget()

    def _forget(self) -> None:
        self._recovery = Recovery()
        self._goal: Point | None = None
        self._earlier_position: Point | None = None  # before _last_position
        self._last_position: Point | None = None

    def plan(self, obs: Observation) -> Decision:
        """Decide on one observation."""
        decision = self.inner.plan(obs)
        if obs.goal != self._goal or is_odometry_jump(decision.reason):
            self._forget()
            self._goal = obs.goal
        if self.params.recovery.enabled:
            decision = self._apply_recovery(decision)
        return _apply_speed_limit(decision, self.params)

    def _apply_recovery(self, decision: Decision) -> Decision:
        """The decision, changed according to the phase of the recovery."""
        if decision.mode is Mode.STOPPED:
            return decision  # its inputs are not valid
        self._remember_position(decision.pose.position)
        if decision.mode in _NOT_DRIVING:
            self._recovery = Recovery()
            return decision
        params, now_ns = self.params.recovery, decision.stamp_ns
        blocked = decision.mode is Mode.BLOCKED
        self._recovery = state = advance(self._recovery, blocked, now_ns, params)
        count = f"attempt {state.attempt} of {params.attempts}"
        if state.phase is Phase.WAIT:
            waited_s = (now_ns - state.since_ns) * NANO
            return replace(decision, reason=f"{decision.reason}; waiting for {waited_s:.1f} s")
        if state.phase is Phase.BACK_OFF:
            return self._back_off(decision, count)
        if state.phase is Phase.REPLAN:
            self.inner.reset()
            return _stopped(decision, f"replanning, {count}: {decision.reason}")
        if state.phase is Phase.GIVEN_UP:
            reason = f"gave up after {state.attempt} attempts; send a goal to go on"
            return _stopped(decision, reason)
        return decision

    def _remember_position(self, position: Point) -> None:
        if self._last_position is None or distance(position, self._last_position) > TRAIL_STEP_M:
            self._earlier_position, self._last_position = self._last_position, position

    def _back_off(self, decision: Decision, count: str) -> Decision:
        """A step to the side with most room, at most half of it; of equals, back."""
        position, tick_s = decision.pose.position, self.params.tick_ns * NANO
        back = bearing(position, self._earlier_position or position)
        heading, room = most_room(decision.ranges_m, back)
        length = min(self.params.recovery.back_off_mps * tick_s, 0.5 * room)
        if not length > 0.0:
            return _stopped(decision, f"no room to back off, {count}")
        waypoint = towards(position, heading, length)
        return replace(
            decision,
            mode=Mode.BLOCKED,
            reason=f"backing off, {count}",
            gap=0,
            waypoint=waypoint,
            velocity=(
                (waypoint[0] - position[0]) / tick_s,
                (waypoint[1] - position[1]) / tick_s,
            ),
            candidates=(),
        )


def supervised_algorithm_1(params: PlannerParams, seed: int) -> SupervisedPlanner:
    """The paper's planner, wrapped. ConfigError for another method or a negative seed."""
    if params.method is not Method.PAPER:
        raise ConfigError(
            f"method={params.method.value}: not Algorithm 1; use planning.planner_factory"
        )
    return SupervisedPlanner(Algorithm1(params, seed))


def _stopped(decision: Decision, reason: str) -> Decision:
    return replace(
        decision,
        mode=Mode.BLOCKED,
        reason=reason,
        gap=0,
        waypoint=decision.pose.position,
        velocity=(0.0, 0.0),
        candidates=(),
    )


def _apply_speed_limit(decision: Decision, params: PlannerParams) -> Decision:
    """The decision with waypoint and velocity scaled to the allowed speed."""
    share = allowed_speed_share(decision.ranges_m, params.speed_limit)
    if share == 1.0 or decision.velocity == (0.0, 0.0):
        return decision
    (x, y), (wx, wy), (vx, vy) = decision.pose.position, decision.waypoint, decision.velocity
    return replace(
        decision,
        reason=f"{decision.reason}; {100.0 * share:.0f} % speed so near",
        waypoint=(x + share * (wx - x), y + share * (wy - y)),
        velocity=(share * vx, share * vy),
    )
