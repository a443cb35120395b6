# SPDX-License-Identifier: Apache-2.0
"""One step of path generation: fresh bats in the disc of one step, alone or many at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.geometry import Point, distance
from ..core.random_streams import stream
from ..swarm.bat_swarm import BatParams, Bounds, Disc, Vector, minimize
from ..swarm.batched_swarms import Array, Swarms

Step = tuple[Point, tuple[Point, ...]]  # the next point, and the last candidates


class Start(NamedTuple):
    """All that decides a step but its options: from where, to which goal, by whose draws."""

    position: Point
    goal: Point
    seed: int
    stamp_ns: int


def generate_step(start: Start, step_length_m: float, bat: BatParams) -> Step:
    """Next point by a fresh swarm in the disc of one step; the last step is cut to the goal.

    Objective: distance of the candidate to GP (eq. 1; eq. 2 is its reciprocal).
    """
    position, goal = start.position, start.goal
    if distance(position, goal) <= step_length_m:
        return goal, ()
    px, py = position
    gx, gy = goal[0] - px, goal[1] - py

    def cost(x: Vector) -> float:
        dx, dy = x[0] - gx, x[1] - gy
        return math.sqrt(dx * dx + dy * dy)

    reach = Disc(step_length_m)
    swarm = minimize(cost, reach, bat, stream(start.seed, start.stamp_ns))
    best = swarm.best_x
    if bat.bounds is Bounds.NONE:
        best = reach.clamp(best)  # bats may leave the disc, the robot cannot
    bx, by = best
    return (px + bx, py + by), tuple([(px + x, py + y) for x, y in swarm.candidates])


def generate_steps(starts: Sequence[Start], step_length_m: float, bat: BatParams) -> list[Step]:
    """fresh_step() of each start, to the last bit, all bats flown at once."""
    found: list[Step] = [(start.goal, ()) for start in starts]
    away = {i: s for i, s in enumerate(starts) if distance(s.position, s.goal) > step_length_m}
    if not away:
        return found
    here = np.array([start.position for start in away.values()]).T
    to_goal = np.array([start.goal for start in away.values()]).T - here

    def cost(x: Array) -> Array:
        dx, dy = x[..., 0] - to_goal[0, :, None], x[..., 1] - to_goal[1, :, None]
        squares: Array = dx * dx + dy * dy
        return np.sqrt(squares)

    # Who has the same seed at the same moment draws the same numbers.
    numbers: dict[tuple[int, int], int] = {}
    shared = [numbers.setdefault((s.seed, s.stamp_ns), len(numbers)) for s in away.values()]
    reach = Disc(step_length_m)
    swarms = Swarms(cost, reach, bat, [stream(*draw) for draw in numbers], shared)
    swarms.run()
    best = swarms.best_x.T.tolist()
    if bat.bounds is Bounds.NONE:
        best = [reach.clamp(x) for x in best]
    xs, ys = (swarms.candidates + here[:, :, None]).tolist()
    for (i, start), (bx, by), x, y in zip(away.items(), best, xs, ys):
        px, py = start.position
        found[i] = (px + bx, py + by), tuple(zip(x, y))
    return found
