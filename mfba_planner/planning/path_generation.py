# SPDX-License-Identifier: Apache-2.0
"""Path generation: a fresh search in the disc of one goal step, for one robot or many."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.geometry import Point, bearing, distance, towards
from ..core.random_streams import stream
from ..optimizers.registry import BATS, NONE, optimize
from ..swarm.bat_swarm import BatParams, Bounds, Disc, Vector
from ..swarm.batched_swarms import Array, Swarms
from ..swarm.optimizer import each

GoalStep = tuple[Point, tuple[Point, ...]]  # the next point, and the last candidates


class StepInput(NamedTuple):
    """Input of one goal step: position and goal, seed and stamp of its random stream."""

    position: Point
    goal: Point
    seed: int
    stamp_ns: int


def generate_step(
    step_input: StepInput, step_length_m: float, bat: BatParams, optimizer: str = BATS
) -> GoalStep:
    """Next point by a fresh search in the disc of one goal step; the last step ends at the goal.

    Objective: distance of the candidate to GP (eq. 1; eq. 2 is its reciprocal). Without an
    optimiser (none) the step goes straight to the goal.
    """
    position, goal = step_input.position, step_input.goal
    if distance(position, goal) <= step_length_m:
        return goal, ()
    if optimizer == NONE:
        return towards(position, bearing(position, goal), step_length_m), ()
    px, py = position
    gx, gy = goal[0] - px, goal[1] - py

    def cost(x: Vector) -> float:
        dx, dy = x[0] - gx, x[1] - gy
        return math.sqrt(dx * dx + dy * dy)

    reach = Disc(step_length_m)
    generator = stream(step_input.seed, step_input.stamp_ns)
    found = optimize(optimizer, bat, reach, generator, each(cost))
    best = found.best_x
    if bat.bounds is Bounds.NONE:
        best = reach.clamp(best)  # the bats may leave the disc, the robot must not
    bx, by = best
    return (px + bx, py + by), tuple([(px + x, py + y) for x, y in found.candidates])


def generate_steps(
    step_inputs: Sequence[StepInput], step_length_m: float, bat: BatParams
) -> list[GoalStep]:
    """generate_step() of each input, bit by bit, with all swarms computed at once."""
    steps: list[GoalStep] = [(step_input.goal, ()) for step_input in step_inputs]
    searched = {
        i: s for i, s in enumerate(step_inputs) if distance(s.position, s.goal) > step_length_m
    }
    if not searched:
        return steps
    positions = np.array([step_input.position for step_input in searched.values()]).T
    to_goal = np.array([step_input.goal for step_input in searched.values()]).T - positions

    def cost(x: Array) -> Array:
        dx, dy = x[..., 0] - to_goal[0, :, None], x[..., 1] - to_goal[1, :, None]
        squares: Array = dx * dx + dy * dy
        return np.sqrt(squares)

    # Equal seed and stamp give the same draws.
    numbers: dict[tuple[int, int], int] = {}
    shared = [numbers.setdefault((s.seed, s.stamp_ns), len(numbers)) for s in searched.values()]
    reach = Disc(step_length_m)
    swarms = Swarms(cost, reach, bat, [stream(*draw) for draw in numbers], shared)
    swarms.run()
    best = swarms.best_x.T.tolist()
    if bat.bounds is Bounds.NONE:
        best = [reach.clamp(x) for x in best]
    xs, ys = (swarms.candidates + positions[:, :, None]).tolist()
    for (i, step_input), (bx, by), x, y in zip(searched.items(), best, xs, ys):
        px, py = step_input.position
        steps[i] = (px + bx, py + by), tuple(zip(x, y))
    return steps
