# SPDX-License-Identifier: Apache-2.0
"""Worlds in the manner of DynaBARN: discs of 0.5 m that cross a square of 20 m on curves.

DynaBARN (Nair et al., SSRR 2022) has three difficulties. Its discs travel from edge to edge along
polynomials whose order grows with the difficulty, in nine pieces, each with a speed of its own:
0.49 to 0.95, 0.99 to 1.45 and 1.40 to 1.95 m/s, on average 0.74, 1.23 and 1.72 m/s, measured on
the published trajectories. These here are drawn anew by the same recipe: no world is copied. A
disc that has reached an edge crosses again from there; DynaBARN's begin anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...core.geometry import Point, bearing, distance
from ...simulation.obstacle_motion import Obstacle, Turn
from .task_geometry import GOAL_M, START_M, leaves_room

RADIUS_M = 0.5
HALF_SIDE_M = 10.0  # of the square around the middle of the trip
PIECES = 9  # of a crossing, each with a speed of its own
SPEED_HALF_RANGE_MPS = 0.23
MARGIN_M = 0.5  # free space around start and goal at t = 0
UNTIL_S = 120.0  # the time limit of a run; then all go on straight


@dataclass(frozen=True, slots=True, kw_only=True)
class Difficulty:
    """Numbers of discs (from, to), their mean speed, and the order of their curves (from, to)."""

    discs: tuple[int, int]
    speed_mps: float
    order: tuple[int, int]


DIFFICULTIES = {
    "easy": Difficulty(discs=(5, 14), speed_mps=0.74, order=(1, 2)),
    "medium": Difficulty(discs=(15, 19), speed_mps=1.23, order=(2, 3)),
    "hard": Difficulty(discs=(20, 24), speed_mps=1.72, order=(3, 5)),
}


def dynabarn_obstacles(name: str, rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """The discs of a world of this difficulty; none is near start or goal at t = 0."""
    difficulty = DIFFICULTIES[name]
    count = int(rng.integers(difficulty.discs[0], difficulty.discs[1] + 1))
    found: list[Obstacle] = []
    while len(found) < count:
        disc = _disc(difficulty, rng)
        if leaves_room(disc.center_m, RADIUS_M, MARGIN_M):
            found.append(disc)
    return tuple(found)


def _disc(difficulty: Difficulty, rng: np.random.Generator) -> Obstacle:
    points = _path_points(difficulty, rng)
    # Somewhere on its first crossing, as in a world that has run for a while.
    start = [next(points) for _ in range(int(rng.integers(1, PIECES)))][-1]
    at_s, position = 0.0, start
    turns: list[Turn] = []
    while at_s < UNTIL_S:
        target = next(points)
        speed = difficulty.speed_mps + rng.uniform(-SPEED_HALF_RANGE_MPS, SPEED_HALF_RANGE_MPS)
        turns.append(Turn(at_s=at_s, speed_mps=speed, heading_rad=bearing(position, target)))
        at_s, position = at_s + distance(position, target) / speed, target
    return Obstacle(
        center_m=start,
        radius_m=RADIUS_M,
        speed_mps=turns[0].speed_mps,
        heading_rad=turns[0].heading_rad,
        turns=tuple(turns[1:]),
    )


def _path_points(difficulty: Difficulty, rng: np.random.Generator) -> Iterator[Point]:
    """Of one crossing after the other, there and back: along one axis, curved along the other."""
    along_x, sign = rng.random() < 0.5, 1.0 if rng.random() < 0.5 else -1.0
    aside = rng.uniform(-HALF_SIDE_M, HALF_SIDE_M)
    first = 0
    while True:
        order = int(rng.integers(difficulty.order[0], difficulty.order[1] + 1))
        values = [aside, *rng.uniform(-HALF_SIDE_M, HALF_SIDE_M, order).tolist()]
        for k in range(first, PIECES + 1):
            u = sign * HALF_SIDE_M * (2.0 * k / PIECES - 1.0)
            aside = min(max(_polynomial(values, k / PIECES), -HALF_SIDE_M), HALF_SIDE_M)
            yield _placed(u, aside) if along_x else _placed(aside, u)
        sign, first = -sign, 1  # the next crossing begins where this one has ended


def _polynomial(values: list[float], share: float) -> float:
    """The polynomial with these values at equal steps of [0, 1], at share of it (Lagrange)."""
    order, total = len(values) - 1, 0.0
    for i, value in enumerate(values):
        for j in range(order + 1):
            if j != i:
                value *= (share * order - j) / (i - j)
        total += value
    return total


def _placed(u: float, v: float) -> Point:
    """A point of the square, given relative to the middle of the trip."""
    return (0.5 * (START_M[0] + GOAL_M[0]) + u, 0.5 * (START_M[1] + GOAL_M[1]) + v)
