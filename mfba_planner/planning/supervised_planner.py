# SPDX-License-Identifier: Apache-2.0
"""Wraps any planner with progress checks, and optionally recovery and a speed limit."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, cast, runtime_checkable

from ..core.errors import ConfigError
from ..core.geometry import Point, bearing, distance, towards
from ..core.planner_types import NANO, Decision, Mode, Observation, PathPlanner, Ranges
from .algorithm_1 import Algorithm1
from .odometry_jump import is_odometry_jump
from .planner_params import Method, PlannerParams
from .progress_checker import ProgressChecker
from .recovery import Phase, Recovery, advance, most_room, wait_after
from .speed_limit import allowed_speed_share

if TYPE_CHECKING:  # the paper's planner has no map and must not load it
    from ..perception.known_map import KnownMap
    from ..perception.obstacle_tracker import Track, Tracker
    from ..perception.static_map import StaticMap

TRAIL_STEP_M = 0.05  # least distance of two remembered positions
_NOT_DRIVING = (Mode.IDLE, Mode.ARRIVED)


class Resettable(PathPlanner, Protocol):
    """A planner with parameters and reset()."""

    params: PlannerParams

    def reset(self) -> None:
        """Drop all state but parameters and seed."""
        ...


@runtime_checkable
class HasSurroundings(Protocol):
    """A planner that may decide without sectors."""

    def surroundings(self, position: Point) -> Ranges:
        """Range per sector to what its last decision was made on; empty if on sectors."""
        ...


@runtime_checkable
class HasLocalMap(Protocol):
    """A planner that keeps a map of what stands."""

    def local_map(self) -> StaticMap:
        """The map, as of its last decision; another one after a reset."""
        ...


@runtime_checkable
class HasTracker(Protocol):
    """A planner that tracks obstacles."""

    tracker: Tracker


@runtime_checkable
class TakesKnownMap(Protocol):
    """A planner that takes a map known before the drive."""

    def set_known_map(self, known_map: KnownMap | None) -> None:
        """Take it; None: there is none."""
        ...


@runtime_checkable
class Replans(Protocol):
    """A planner that can begin anew without forgetting its surroundings."""

    def replan(self) -> None:
        """Drop all state but parameters, seed and what is known of the surroundings."""
        ...


class SupervisedPlanner:
    """Passes the decisions of a planner on, changed only by the options below.

    With recovery.enabled, BLOCKED decisions go through the phases of planning.recovery. So does
    a robot that drives without progress (planning.progress_checker), also without
    recovery.enabled, but then it does not back off. With speed_limit.slow_within_m, velocities
    are reduced near obstacles. All depends only on the observations, so a recording reproduces
    the decisions.
    """

    def __init__(self, inner: Resettable) -> None:
        """Wrap a planner."""
        self.inner = inner
        # Asked for at every tick; comparing with a protocol takes several microseconds.
        self._takes_known_map = isinstance(inner, TakesKnownMap)
        self._has_local_map = isinstance(inner, HasLocalMap)
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

    @property
    def local_map(self) -> StaticMap | None:
        """The map of the wrapped planner, None if it keeps none."""
        return cast(HasLocalMap, self.inner).local_map() if self._has_local_map else None

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The obstacles that the wrapped planner tracks, none if it does not."""
        return self.inner.tracker.tracks if isinstance(self.inner, HasTracker) else ()

    def set_known_map(self, known_map: KnownMap | None) -> None:
        """Give the map to the wrapped planner, if it takes one."""
        if self._takes_known_map:
            cast(TakesKnownMap, self.inner).set_known_map(known_map)

    def reset(self) -> None:
        """Drop all state but parameters, seed and known map (a clock reset, a new trip)."""
        self.inner.reset()
        self._forget()

    def _forget(self) -> None:
        self._recovery = Recovery()
        self._progress = ProgressChecker()
        self._no_progress = ""  # the reason, until the planner tries again
        self._cause = ""  # of the present recovery
        self._goal: Point | None = None
        self._earlier_position: Point | None = None  # before _last_position
        self._last_position: Point | None = None

    def plan(self, obs: Observation) -> Decision:
        """Decide on one observation."""
        decision = self.inner.plan(obs)
        if obs.goal != self._goal or is_odometry_jump(decision.reason):
            self._forget()
            self._goal = obs.goal
        return self._apply_speed_limit(self._supervise(decision))

    def _supervise(self, decision: Decision) -> Decision:
        """The decision, changed if the robot makes no progress or recovers."""
        if decision.mode is Mode.STOPPED:  # its inputs are not valid
            self._progress.pause()
            return decision
        self._remember_position(decision.pose.position)
        if decision.mode in _NOT_DRIVING:
            self._recovery, self._no_progress = Recovery(), ""
            self._progress = ProgressChecker()
            return decision
        self._check_progress(decision)
        if self._no_progress or self.params.recovery.enabled:
            return self._apply_recovery(decision)
        self._recovery = Recovery()
        return decision

    def _check_progress(self, decision: Decision) -> None:
        """Begin the recovery if the robot makes no progress although it drives."""
        if self.phase is not Phase.FREE or decision.mode is Mode.BLOCKED:
            self._progress.pause()
            return
        self._no_progress = self._progress.check(decision, self.params.progress)
        if self._no_progress:
            self._recovery = wait_after(self._progress.tries, decision.stamp_ns)

    def _apply_recovery(self, decision: Decision) -> Decision:
        """The decision, changed according to the phase of the recovery."""
        params, now_ns = self.params.recovery, decision.stamp_ns
        cause = self._no_progress or decision.reason
        blocked = bool(self._no_progress) or decision.mode is Mode.BLOCKED
        if blocked and self.phase is not Phase.GIVEN_UP:
            self._cause = cause
        self._recovery = state = advance(self._recovery, blocked, now_ns, params)
        count = f"attempt {state.attempt} of {params.attempts}"
        if state.phase is Phase.WAIT:
            reason = f"{cause}; waiting for {(now_ns - state.since_ns) * NANO:.1f} s"
            return _stopped(decision, reason)
        if state.phase is Phase.BACK_OFF:
            if params.enabled:
                return self._back_off(decision, count)
            return _stopped(decision, f"{cause}; at rest, {count}")
        if state.phase is Phase.REPLAN:
            self._try_again()
            return _stopped(decision, f"replanning, {count}: {cause}")
        if state.phase is Phase.GIVEN_UP:
            # That every gap is closed was always left out, and recordings are compared.
            gaps = self.params.method is Method.PAPER and not self._no_progress
            why = "" if gaps else f", {self._cause}"
            reason = f"gave up after {state.attempt} attempts{why}; send a goal to go on"
            return _stopped(decision, reason)
        return decision

    def _try_again(self) -> None:
        """Let the planner begin anew."""
        if isinstance(self.inner, Replans):
            self.inner.replan()
        else:
            self.inner.reset()
        if self._no_progress:
            self._progress.restart()
            self._no_progress = ""

    def _remember_position(self, position: Point) -> None:
        if self._last_position is None or distance(position, self._last_position) > TRAIL_STEP_M:
            self._earlier_position, self._last_position = self._last_position, position

    def _back_off(self, decision: Decision, count: str) -> Decision:
        """A step to the side with most room, at most half of it; of equals, back."""
        position, tick_s = decision.pose.position, self.params.tick_ns * NANO
        back = bearing(position, self._earlier_position or position)
        surroundings = self._surroundings(decision)
        heading, room = most_room(surroundings, back) if surroundings else (back, 0.0)
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

    def _surroundings(self, decision: Decision) -> Ranges:
        """Ranges like those of sectors, of what the decision was made on."""
        if isinstance(self.inner, HasSurroundings):
            return self.inner.surroundings(decision.pose.position) or decision.ranges_m
        return decision.ranges_m

    def _apply_speed_limit(self, decision: Decision) -> Decision:
        """The decision with waypoint and velocity scaled to the allowed speed."""
        params = self.params.speed_limit
        if params.slow_within_m == 0.0 or decision.velocity == (0.0, 0.0):
            return decision
        share = allowed_speed_share(self._surroundings(decision), params)
        if share == 1.0:
            return decision
        (x, y), (wx, wy), (vx, vy) = decision.pose.position, decision.waypoint, decision.velocity
        return replace(
            decision,
            reason=f"{decision.reason}; {100.0 * share:.0f} % speed so near",
            waypoint=(x + share * (wx - x), y + share * (wy - y)),
            velocity=(share * vx, share * vy),
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
