# SPDX-License-Identifier: Apache-2.0
"""Any planner, slower where it is narrow and with a way out of a blocked state: both optional."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from ..core.errors import ConfigError
from ..core.geometry import Point, bearing, distance, towards
from ..core.types import NANO, Decision, Mode, Observation, PathPlanner
from .algorithm_1 import Algorithm1
from .odometry_jump import is_jump_reason
from .planner_params import Method, PlannerParams
from .recovery import Phase, Recovery, advance, most_room
from .speed_limit import allowed_speed_share

TRAIL_M = 0.05  # so far back is where the robot came from
_STANDING = (Mode.IDLE, Mode.ARRIVED)


class Resettable(PathPlanner, Protocol):
    """A planner that has parameters and can forget."""

    params: PlannerParams

    def reset(self) -> None:
        """Forget everything but parameters and seed."""
        ...


class SupervisedPlanner:
    """A planner whose decisions are passed on unchanged unless an option says otherwise.

    With recovery.enabled, BLOCKED decisions lead through planning.recovery's phases; with
    speed_limit.slow_within_m, every move is shortened near obstacles. It knows nothing but the
    observations: a recording decides again what was decided.
    """

    def __init__(self, inner: Resettable) -> None:
        """Start with nothing remembered."""
        self.inner = inner
        self._forget()

    @property
    def params(self) -> PlannerParams:
        """The parameters of the planner within."""
        return self.inner.params

    @params.setter
    def params(self, changed: PlannerParams) -> None:
        self.inner.params = changed

    @property
    def phase(self) -> Phase:
        """Where the recovery stands."""
        return self._recovery.phase

    def reset(self) -> None:
        """Forget everything but parameters and seed (a jump of time, a new trip)."""
        self.inner.reset()
        self._forget()

    def _forget(self) -> None:
        self._recovery = Recovery()
        self._goal: Point | None = None
        self._from: Point | None = None  # where the robot was before it came here
        self._here: Point | None = None

    def plan(self, obs: Observation) -> Decision:
        """Answer one observation."""
        decision = self.inner.plan(obs)
        if obs.goal != self._goal or is_jump_reason(decision.reason):
            self._forget()
            self._goal = obs.goal
        if self.params.recovery.enabled:
            decision = self._recovered(decision)
        return _slowed(decision, self.params)

    def _recovered(self, decision: Decision) -> Decision:
        """The decision, or what the phase of the recovery makes of it."""
        if decision.mode is Mode.STOPPED:
            return decision  # what it sees is not to be trusted
        self._remember(decision.pose.position)
        if decision.mode in _STANDING:
            self._recovery = Recovery()
            return decision
        params, now_ns = self.params.recovery, decision.stamp_ns
        blocked = decision.mode is Mode.BLOCKED
        self._recovery = state = advance(self._recovery, blocked, now_ns, params)
        of = f"attempt {state.attempt} of {params.attempts}"
        if state.phase is Phase.WAIT:
            waited_s = (now_ns - state.since_ns) * NANO
            return replace(decision, reason=f"{decision.reason}; waiting for {waited_s:.1f} s")
        if state.phase is Phase.BACK_OFF:
            return self._backing_off(decision, of)
        if state.phase is Phase.REPLAN:
            self.inner.reset()
            return _standing(decision, f"replanning, {of}: {decision.reason}")
        if state.phase is Phase.GIVEN_UP:
            why = f"gave up after {state.attempt} attempts; send a goal to go on"
            return _standing(decision, why)
        return decision

    def _remember(self, position: Point) -> None:
        if self._here is None or distance(position, self._here) > TRAIL_M:
            self._from, self._here = self._here, position

    def _backing_off(self, decision: Decision, of: str) -> Decision:
        """A step of at most half the room to where most is; of equals, where it came from."""
        position, tick_s = decision.pose.position, self.params.tick_ns * NANO
        back = bearing(position, self._from or position)
        heading, room = most_room(decision.ranges_m, back)
        length = min(self.params.recovery.back_off_mps * tick_s, 0.5 * room)
        if not length > 0.0:
            return _standing(decision, f"no room to back off, {of}")
        waypoint = towards(position, heading, length)
        return replace(
            decision,
            mode=Mode.BLOCKED,
            reason=f"backing off, {of}",
            gap=0,
            waypoint=waypoint,
            velocity=(
                (waypoint[0] - position[0]) / tick_s,
                (waypoint[1] - position[1]) / tick_s,
            ),
            candidates=(),
        )


def supervised_algorithm_1(params: PlannerParams, seed: int) -> SupervisedPlanner:
    """The paper's planner. Raises ConfigError where params name another one, or for the seed."""
    if params.method is not Method.PAPER:
        raise ConfigError(
            f"method={params.method.value}: not the core's own; use planning.planner_factory"
        )
    return SupervisedPlanner(Algorithm1(params, seed))


def _standing(decision: Decision, reason: str) -> Decision:
    return replace(
        decision,
        mode=Mode.BLOCKED,
        reason=reason,
        gap=0,
        waypoint=decision.pose.position,
        velocity=(0.0, 0.0),
        candidates=(),
    )


def _slowed(decision: Decision, params: PlannerParams) -> Decision:
    """The same move, shortened to what the clearance allows."""
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
