# SPDX-License-Identifier: Apache-2.0
"""Base class of all planners but the paper's: stop conditions, modes, Decision; Move."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..core.errors import ConfigError
from ..core.geometry import Point
from ..core.planner_types import NANO, Bits, Decision, Mode, Observation
from ..perception.near_returns import blind_ring, near_at_contact
from ..perception.sensory_vector import SensorParams
from .mode_transitions import Event, transition
from .odometry_jump import OdometryJump, with_odometry_jump
from .planner_params import PlannerParams
from .stop_conditions import reason_to_stop
from .stopping_distance import too_fast_for_lidar


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """The velocity during the next tick (m/s in the odom frame) and its reason.

    The rest is only recorded: bits and gap if the planner has any (gap counts from 1), the
    waypoint (default: the position after the next tick), and the candidate points.
    """

    velocity: Point
    reason: str
    event: Event = Event.CLEAR
    vs: Bits = ()
    vg: Bits = ()
    gap: int = 0
    waypoint: Point | None = None
    candidates: tuple[Point, ...] = ()


def blocked(reason: str, vs: Bits = ()) -> Move:
    """Stand still; the mode becomes BLOCKED."""
    return Move(velocity=(0.0, 0.0), reason=reason, event=Event.NO_GAP, vs=vs, vg=vs)


class BasePlanner:
    """A planner that calls move() unless a stop condition of the paper's planner holds.

    Subclasses define move(), and forget() if they keep state; forget() is called before the
    first observation and by reset(). A subclass that never reads ranges_m when circles or a scan
    are given sets reads_sectors to False; sweeps then do not compute sectors. inputs are the ways
    to observe obstacles of which one is enough; without any of them the planner stops, because
    it must not take unknown space for free. () is for a planner that ignores obstacles.
    """

    reads_sectors = True
    inputs: tuple[str, ...] = ("sectors", "circles", "scan")

    def __init__(self, params: PlannerParams, sensor: SensorParams, seed: int) -> None:
        """Start idle; ConfigError for a negative seed."""
        if seed < 0:
            raise ConfigError(f"seed={seed}: negative; give a whole number from 0 up")
        self.params = params
        self.sensor = sensor
        self.seed = seed
        self._odometry_jump = OdometryJump()
        self.tick_s = params.tick_ns * NANO
        self.reset()

    def reset(self) -> None:
        """Drop all state but parameters and seed (after a clock reset, before a new trip)."""
        self.mode = Mode.IDLE
        self._goal: Point | None = None
        self.forget()

    def replan(self) -> None:
        """Begin anew in the same surroundings, as the robot has made no progress."""
        self.reset()

    def forget(self) -> None:
        """Drop the state of a subclass."""

    def move(self, obs: Observation, goal: Point) -> Move:
        """Choose the next tick's velocity; the inputs are valid and the goal is not reached."""
        raise NotImplementedError

    def plan(self, obs: Observation) -> Decision:
        """Decide on one observation and update the mode; after an odometry jump, reset first."""
        obs = _with_near_at_contact(obs, self.params.robot_radius_m)
        odometry_jump_reason = self._odometry_jump.detect(obs, self.params, self.mode)
        if odometry_jump_reason:
            self.reset()
        if obs.goal != self._goal:
            self.mode = transition(self.mode, Event.NEW_GOAL)
            self._goal = obs.goal
        stop = reason_to_stop(obs, self.params, sectors=False) or self._unusable_input(obs)
        if stop is None and self.mode is not Mode.ARRIVED:
            assert obs.goal is not None
            move = self.move(obs, obs.goal)
        else:
            event, reason = stop or (Event.CLEAR, "on the way")
            if self.mode is Mode.ARRIVED and event is not Event.AT_GOAL:
                reason = f"goal was reached before; {reason}"
            move = Move(velocity=(0.0, 0.0), reason=reason, event=event)
        self.mode = transition(self.mode, move.event)
        return with_odometry_jump(self._decision(obs, move), odometry_jump_reason)

    def _unusable_input(self, obs: Observation) -> tuple[Event, str] | None:
        """Nothing that shows obstacles, or a lidar within whose range the robot cannot stop."""
        if self.inputs and not set(_given_inputs(obs)) & set(self.inputs):
            return Event.INVALID, f"refused input: none of {', '.join(self.inputs)}"
        if obs.scan is None or self._perception(obs) != "scan":
            return None
        fault = too_fast_for_lidar(self.params, obs.scan.range_max_m, obs.scan.origin_m)
        return (Event.INVALID, f"refused input: {fault}") if fault else None

    def straight(self, position: Point, target: Point, speed_mps: float) -> Point:
        """Velocity towards the target, at most speed_mps, and not beyond the target in a tick."""
        dx, dy = target[0] - position[0], target[1] - position[1]
        remaining_m = math.sqrt(dx * dx + dy * dy)
        reach = speed_mps * self.params.tick_ns * NANO
        scale = 1.0 / self.tick_s if remaining_m <= reach else speed_mps / remaining_m
        return (dx * scale, dy * scale)

    def _decision(self, obs: Observation, move: Move) -> Decision:
        waypoint = move.waypoint
        if waypoint is None:
            dt, pose, (vx, vy) = self.tick_s, obs.pose, move.velocity
            waypoint = (pose.x + vx * dt, pose.y + vy * dt)
        return Decision(
            stamp_ns=obs.stamp_ns,
            mode=self.mode,
            reason=move.reason,
            pose=obs.pose,
            goal=obs.goal,
            ranges_m=obs.ranges_m,
            vs=move.vs,
            vg=move.vg,
            gap=move.gap,
            waypoint=waypoint,
            velocity=move.velocity,
            candidates=move.candidates,
            perception=self._perception(obs),
        )

    def _perception(self, obs: Observation) -> str:
        """The input by which move() perceives obstacles: the first of circles, scan, sectors."""
        given = _given_inputs(obs)
        return next((name for name in reversed(given) if name in self.inputs), "")


def _given_inputs(obs: Observation) -> list[str]:
    """Names of the inputs that an observation holds, the most informative one last."""
    given = (
        ("sectors", bool(obs.ranges_m)),
        ("scan", obs.scan is not None),
        ("circles", obs.circles is not None),
    )
    return [name for name, is_given in given if is_given]


def _with_near_at_contact(obs: Observation, robot_radius_m: float) -> Observation:
    if obs.scan is None or not blind_ring(obs.scan, robot_radius_m):
        return obs
    return replace(obs, scan=near_at_contact(obs.scan, robot_radius_m))
