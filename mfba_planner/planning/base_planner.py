# SPDX-License-Identifier: Apache-2.0
"""What every planner but the paper's has in common: a new one only says how to move."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.errors import ConfigError
from ..core.geometry import Point
from ..core.types import NANO, Bits, Decision, Mode, Observation
from ..perception.sensory_vector import SensorParams
from .mode_transitions import Event, transition
from .odometry_jump import OdometryJump, with_jump_reason
from .planner_params import PlannerParams
from .stop_conditions import reason_to_stop


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """How to move during the next tick (m/s in the odom frame) and why.

    The rest is for the record: bits and gaps where the planner has any (gap counts from 1),
    the waypoint where it is not what the velocity leads to, and the points it weighed.
    """

    velocity: Point
    reason: str
    event: Event = Event.CLEAR
    vs: Bits = ()
    vg: Bits = ()
    gap: int = 0
    waypoint: Point | None = None
    candidates: tuple[Point, ...] = ()


class BasePlanner:
    """A planner that moves by move() and stands still for the reasons the paper's does.

    Subclasses define move(), and where they remember anything forget(), which is called
    before the first observation and by reset(). Who never reads ranges_m where circles or a scan
    are given sets reads_sectors to False: sweeps then spare themselves what sectors cost.
    """

    reads_sectors = True

    def __init__(self, params: PlannerParams, sensor: SensorParams, seed: int) -> None:
        """Start idle; ConfigError for a negative seed."""
        if seed < 0:
            raise ConfigError(f"seed={seed}: negative; give a whole number from 0 up")
        self.params = params
        self.sensor = sensor
        self.seed = seed
        self._watch = OdometryJump()
        self.tick_s = params.tick_ns * NANO
        self.reset()

    def reset(self) -> None:
        """Forget everything but parameters and seed (a jump of time, a new trip)."""
        self.mode = Mode.IDLE
        self._goal: Point | None = None
        self.forget()

    def forget(self) -> None:
        """Drop what a subclass remembers from tick to tick."""

    def move(self, obs: Observation, goal: Point) -> Move:
        """Choose the next tick's velocity; the inputs are sound and the goal is not reached."""
        raise NotImplementedError

    def plan(self, obs: Observation) -> Decision:
        """Answer one observation and remember the mode; who was carried off begins anew."""
        carried = self._watch.detect(obs, self.params, self.mode)
        if carried:
            self.reset()
        if obs.goal != self._goal:
            self.mode = transition(self.mode, Event.NEW_GOAL)
            self._goal = obs.goal
        standing = reason_to_stop(obs, self.params, sectors=False)
        if standing is None and self.mode is not Mode.ARRIVED:
            assert obs.goal is not None
            move = self.move(obs, obs.goal)
        else:
            event, reason = standing or (Event.CLEAR, "on the way")
            if self.mode is Mode.ARRIVED and event is not Event.AT_GOAL:
                reason = f"goal was reached before; {reason}"
            move = Move(velocity=(0.0, 0.0), reason=reason, event=event)
        self.mode = transition(self.mode, move.event)
        return with_jump_reason(self._decision(obs, move), carried)

    def straight(self, position: Point, target: Point, speed_mps: float) -> Point:
        """The velocity that leads to the target at most at this speed, and not beyond it."""
        dx, dy = target[0] - position[0], target[1] - position[1]
        left = math.sqrt(dx * dx + dy * dy)
        reach = speed_mps * self.params.tick_ns * NANO
        scale = 1.0 / self.tick_s if left <= reach else speed_mps / left
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
        )
