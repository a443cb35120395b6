# SPDX-License-Identifier: Apache-2.0
"""Algorithm 1: switch between path generation (bats) and obstacle avoidance (gap vector)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ..core.errors import ConfigError
from ..core.geometry import Point, bearing, distance, towards
from ..core.random_streams import stream
from ..core.types import NANO, Bits, Decision, Mode, Observation
from ..perception.sensory_vector import sensory_vector
from ..swarm.bat_swarm import BatSwarm, Disc, Vector
from .gap_vector import gap_heading, gap_vector, nearest_free_gap
from .mode_transitions import Event, transition
from .odometry_jump import OdometryJump, with_jump_reason
from .path_generation import Start, Step, generate_step, generate_steps
from .planner_params import PlannerParams, Swarm
from .stop_conditions import reason_to_stop

FEW = 8  # bats of so few planners are no quicker at once


Generate = Callable[[Point, Point], Step]


def decide(obs: Observation, mode: Mode, params: PlannerParams, generate: Generate) -> Decision:
    """One turn of Algorithm 1's loop: a pure function of its arguments.

    generate(position, goal) returns the bats' next point and all their candidates; it is
    called in path generation only. Standing still is the answer to everything that is not
    path generation or obstacle avoidance, input that is not finite included.
    """
    vs = sensory_vector(obs.ranges_m)
    vg = gap_vector(vs)
    position = obs.pose.position
    event, reason, gap = _assess(obs, vs, vg, params)
    mode = transition(mode, event)
    if mode is Mode.ARRIVED and event is not Event.AT_GOAL:
        reason, gap = f"goal was reached before; {reason}", 0
    waypoint = position
    velocity = (0.0, 0.0)  # not a difference: inf - inf is NaN
    candidates: tuple[Point, ...] = ()
    if mode is Mode.PATH_GENERATION:
        assert obs.goal is not None
        waypoint, candidates = generate(position, obs.goal)
    elif mode is Mode.OBSTACLE_AVOIDANCE:
        assert obs.goal is not None
        length = min(params.step_length_m, distance(position, obs.goal))
        waypoint = towards(position, gap_heading(gap, len(vg), params.gap_heading), length)
    if waypoint is not position:
        dt = params.tick_ns * NANO
        velocity = ((waypoint[0] - position[0]) / dt, (waypoint[1] - position[1]) / dt)
    return Decision(
        stamp_ns=obs.stamp_ns,
        mode=mode,
        reason=reason,
        pose=obs.pose,
        goal=obs.goal,
        ranges_m=obs.ranges_m,
        vs=vs,
        vg=vg,
        gap=gap,
        waypoint=waypoint,
        velocity=velocity,
        candidates=candidates,
    )


def _assess(obs: Observation, vs: Bits, vg: Bits, params: PlannerParams) -> tuple[Event, str, int]:
    """Reduce an observation to one event, its reason and the chosen gap (0 when none)."""
    standing = reason_to_stop(obs, params)
    if standing:
        return *standing, 0
    assert obs.goal is not None
    position = obs.pose.position
    if not any(vs):
        return Event.CLEAR, "no obstacle within SR", 0
    sensed = "+".join(str(i) for i, bit in enumerate(vs, start=1) if bit)
    gap = nearest_free_gap(vg, bearing(position, obs.goal), params.gap_heading)
    if gap is None:
        return Event.NO_GAP, f"sectors {sensed} set: every gap is closed", 0
    return Event.OBSTACLE, f"sectors {sensed} set: gap {gap} is nearest to the goal", gap


class Algorithm1:
    """Algorithm 1 with its memory: the mode, and the swarm where a reading keeps one.

    The random stream of a decision depends on (seed, stamp) only, so a planner that is
    restarted, or fed from a recording, decides as the first one did (fresh swarms).
    """

    def __init__(self, params: PlannerParams, seed: int) -> None:
        """Start idle; ConfigError for a negative seed."""
        if seed < 0:
            raise ConfigError(f"seed={seed}: negative; give a whole number from 0 up")
        self.params = params
        self.seed = seed
        self.mode = Mode.IDLE
        self._goal: Point | None = None
        self._swarm: BatSwarm | None = None
        self._stamp_ns = 0
        self._watch = OdometryJump()
        self._generated_step: tuple[tuple[Start, PlannerParams], Step] | None = None

    def reset(self) -> None:
        """Forget everything but parameters and seed (a jump of time, a new trip)."""
        self.mode, self._goal, self._swarm = Mode.IDLE, None, None

    def plan(self, obs: Observation) -> Decision:
        """Answer one observation and remember the mode; who was carried off begins anew."""
        carried = self._watch.detect(obs, self.params, self.mode)
        if carried:
            self.reset()
        if obs.goal != self._goal:
            self.mode = transition(self.mode, Event.NEW_GOAL)
            self._goal, self._swarm = obs.goal, None
        self._stamp_ns = obs.stamp_ns
        decision = decide(obs, self.mode, self.params, self._generate)
        self.mode = decision.mode
        return with_jump_reason(decision, carried)

    def _generate(self, position: Point, goal: Point) -> Step:
        params = self.params
        if params.swarm is Swarm.PERSISTENT:
            return self._continue_swarm(position, goal)
        start = Start(position, goal, self.seed, self._stamp_ns)
        foreseen, self._generated_step = self._generated_step, None
        if foreseen is not None and foreseen[0] == (start, params):
            return foreseen[1]
        return generate_step(start, params.step_length_m, params.bat)

    def start(self, obs: Observation) -> Start | None:
        """What fresh_step() will be asked for by plan(), None where it will not be."""
        if self.params.swarm is not Swarm.FRESH or obs.goal is None or obs.refused:
            return None
        if any(sensory_vector(obs.ranges_m)):
            return None
        return Start(obs.pose.position, obs.goal, self.seed, obs.stamp_ns)

    def accept_generated_step(self, start: Start, params: PlannerParams, step: Step) -> None:
        """Take what fresh_steps() found; plan() uses it if it is just what it would ask for."""
        self._generated_step = (start, params), step

    def _continue_swarm(self, position: Point, goal: Point) -> Step:
        """Fig. 1 read literally: bat.iterations per robot step, within the robot's reach.

        The bats stay where they are in the world, but are drawn into the disc of one step
        around the robot, as is the best point they ever saw; the robot goes to that point.
        T of eq. 10 spans the trip: all iterations of the straight way from here to the goal.
        """
        reach = self.params.step_length_m
        if distance(position, goal) <= reach:
            return goal, ()
        disc, bat = Disc(reach, position), self.params.bat

        def cost(x: Vector) -> float:
            return distance((x[0], x[1]), goal)

        if self._swarm is None:
            horizon = bat.iterations * math.ceil(distance(position, goal) / reach)
            rng = stream(self.seed, self._stamp_ns)
            self._swarm = BatSwarm(bat, disc, rng, horizon)
        else:
            self._swarm.change_region(disc, cost)
        for _ in range(bat.iterations):
            self._swarm.tell([cost(x) for x in self._swarm.ask()])
        x, y = disc.clamp(self._swarm.best_x)
        return (x, y), tuple((px, py) for px, py in self._swarm.candidates)


def generate_paths_together(
    planners: Sequence[Algorithm1], observations: Sequence[Observation]
) -> None:
    """Let the bats of all that are about to generate a path fly at once, before they plan().

    Their decisions stay the same to the last bit. Who has other params than the first flies
    alone later, as do few: arrays cost more than they spare then.
    """
    about = [(planner, planner.start(obs)) for planner, obs in zip(planners, observations)]
    starting = [(planner, start) for planner, start in about if start is not None]
    if len(starting) < FEW:
        return
    params = starting[0][0].params
    starts = [start for _, start in starting]
    steps = generate_steps(starts, params.step_length_m, params.bat)
    for (planner, start), step in zip(starting, steps):
        planner.accept_generated_step(start, params, step)
