# SPDX-License-Identifier: Apache-2.0
"""Algorithm 1, the paper's planner: path generation (bats), obstacle avoidance (gap vector)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ..core.errors import ConfigError
from ..core.geometry import Point, bearing, distance, towards
from ..core.planner_types import NANO, Bits, Decision, Mode, Observation
from ..core.random_streams import stream
from ..optimizers.registry import BATS, require_optimizer
from ..perception.sensory_vector import sensory_vector
from ..swarm.bat_swarm import BatSwarm, Disc, Vector
from .gap_vector import gap_heading, gap_vector, nearest_free_gap
from .mode_transitions import Event, transition
from .odometry_jump import OdometryJump, with_odometry_jump
from .path_generation import GoalStep, StepInput, generate_step, generate_steps
from .planner_params import PlannerParams, Swarm
from .stop_conditions import reason_to_stop

MIN_BATCH = 8  # planners; fewer are faster one by one


Generate = Callable[[Point, Point], GoalStep]


def decide(obs: Observation, mode: Mode, params: PlannerParams, generate: Generate) -> Decision:
    """One iteration of Algorithm 1's loop: a pure function of its arguments.

    generate(position, goal) returns the bats' next point and all their candidates; it is called
    in path generation only. In every other mode but obstacle avoidance the robot stops, also for
    input that is not finite.
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
        perception="sectors" if obs.ranges_m else "",
    )


def _assess(obs: Observation, vs: Bits, vg: Bits, params: PlannerParams) -> tuple[Event, str, int]:
    """The event of an observation, its reason and the chosen gap (0 for none)."""
    stop = reason_to_stop(obs, params)
    if stop:
        return *stop, 0
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
    """Algorithm 1 with its state: the mode, and the swarm if Swarm.PERSISTENT.

    The random stream of a decision depends on (seed, stamp) only. So with Swarm.FRESH a planner
    that is restarted, or reads a recording, makes the same decisions.
    """

    def __init__(self, params: PlannerParams, seed: int) -> None:
        """Start idle; ConfigError for a negative seed or an unknown optimiser."""
        if seed < 0:
            raise ConfigError(f"seed={seed}: negative; give a whole number from 0 up")
        require_optimizer(params.optimizer)
        self.params = params
        self.seed = seed
        self.mode = Mode.IDLE
        self._goal: Point | None = None
        self._swarm: BatSwarm | None = None
        self._stamp_ns = 0
        self._odometry_jump = OdometryJump()
        self._generated_step: tuple[tuple[StepInput, PlannerParams], GoalStep] | None = None

    def reset(self) -> None:
        """Drop all state but parameters and seed (after a clock reset, before a new trip)."""
        self.mode, self._goal, self._swarm = Mode.IDLE, None, None

    def plan(self, obs: Observation) -> Decision:
        """Decide on one observation and update the mode; after an odometry jump, reset first."""
        odometry_jump_reason = self._odometry_jump.detect(obs, self.params, self.mode)
        if odometry_jump_reason:
            self.reset()
        if obs.goal != self._goal:
            self.mode = transition(self.mode, Event.NEW_GOAL)
            self._goal, self._swarm = obs.goal, None
        self._stamp_ns = obs.stamp_ns
        decision = decide(obs, self.mode, self.params, self._generate)
        self.mode = decision.mode
        return with_odometry_jump(decision, odometry_jump_reason)

    def _generate(self, position: Point, goal: Point) -> GoalStep:
        params = self.params
        if params.swarm is Swarm.PERSISTENT:
            return self._continue_swarm(position, goal)
        step_input = StepInput(position, goal, self.seed, self._stamp_ns)
        precomputed, self._generated_step = self._generated_step, None
        if precomputed is not None and precomputed[0] == (step_input, params):
            return precomputed[1]
        return generate_step(step_input, params.step_length_m, params.bat, params.optimizer)

    def step_input(self, obs: Observation) -> StepInput | None:
        """The input plan() will pass to generate_step(), None if it will not call it.

        None too for another optimiser than the bats, of which there is no batched form.
        """
        if self.params.swarm is not Swarm.FRESH or self.params.optimizer != BATS:
            return None
        if obs.goal is None or obs.refused:
            return None
        if any(sensory_vector(obs.ranges_m)):
            return None
        return StepInput(obs.pose.position, obs.goal, self.seed, obs.stamp_ns)

    def accept_generated_step(
        self, step_input: StepInput, params: PlannerParams, step: GoalStep
    ) -> None:
        """Store a result of generate_steps(); plan() uses it if its own input is the same."""
        self._generated_step = (step_input, params), step

    def _continue_swarm(self, position: Point, goal: Point) -> GoalStep:
        """Fig. 1 read literally: one swarm for the trip, bat.iterations per goal step.

        The bats keep their positions in the world, but they and their best point are clamped into
        the disc of one goal step around the robot. The robot moves to the best point. T of eq. 10
        is the number of all iterations on the straight line from the first position to the goal.
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
    """Compute the next path generation step of many planners at once, before their plan().

    Their decisions stay the same bit by bit. A planner whose params differ from the first one's
    computes its step itself in plan(), as do fewer than MIN_BATCH planners.
    """
    inputs = [(planner, planner.step_input(obs)) for planner, obs in zip(planners, observations)]
    batch = [(planner, step_input) for planner, step_input in inputs if step_input is not None]
    if len(batch) < MIN_BATCH:
        return
    params = batch[0][0].params
    step_inputs = [step_input for _, step_input in batch]
    steps = generate_steps(step_inputs, params.step_length_m, params.bat)
    for (planner, step_input), step in zip(batch, steps):
        planner.accept_generated_step(step_input, params, step)
