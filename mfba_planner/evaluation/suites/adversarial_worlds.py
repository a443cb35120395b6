# SPDX-License-Identifier: Apache-2.0
"""Adversarial worlds: obstacles aimed at the robot's straight trip.

No obstacle reacts: every motion is a closed-form function of t, aimed at where a robot on the
straight line would be. All are slower than the robot, and with the margins chosen here a free path
nearly always exists; the oracle certifies it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from ...core.geometry import Point, bearing, distance, towards
from ...simulation.obstacle_motion import Obstacle, Turn
from .task_geometry import OBSTACLE_RADIUS_M, ROBOT_RADIUS_M, Trip, leaves_room

ENLARGED_M = OBSTACLE_RADIUS_M + ROBOT_RADIUS_M
_MARGIN_M = 0.3  # free space around start and goal at t = 0
_SPEEDS = (0.25, 0.6)  # of the obstacles, as shares of the robot's speed

Family = Callable[[Trip, np.random.Generator], Iterator[Obstacle]]


def pincers(trip: Trip, rng: np.random.Generator) -> Iterator[Obstacle]:
    """Pairs that come from both sides and meet where the robot would be at that time."""
    pairs = int(rng.integers(2, 5))
    for number in range(pairs):
        t = trip.time_s * (number + rng.uniform(0.4, 0.9)) / pairs
        speed = trip.speed_mps * rng.uniform(*_SPEEDS)
        for side in (1.0, -1.0):
            along = t * trip.speed_mps
            meeting = trip.beside(along, side * rng.uniform(0.0, 0.5))
            comes_from = trip.heading(side * rng.uniform(math.radians(40), math.radians(120)))
            yield _mover(towards(meeting, comes_from, speed * t), speed, comes_from + math.pi)


def streams(trip: Trip, rng: np.random.Generator) -> Iterator[Obstacle]:
    """Lanes of traffic across the straight trip, in both directions, with narrow gaps."""
    lanes = int(rng.integers(2, 5))
    for number in range(lanes):
        along = trip.length_m * (number + rng.uniform(0.5, 0.9)) / lanes
        side = 1.0 if rng.random() < 0.5 else -1.0
        speed = trip.speed_mps * rng.uniform(*_SPEEDS)
        heading = trip.heading(-side * math.pi / 2.0 + rng.uniform(-0.3, 0.3))
        spacing = rng.uniform(1.5, 2.8)
        # obstacles that cross the trip from about 6 s before to 6 s after the robot
        middle = trip.beside(along, 0.0)
        t = along / trip.speed_mps
        phase = rng.uniform(0.0, 1.0)
        for k in range(-3, 4):
            lead = speed * t + (k + phase) * spacing
            yield _mover(towards(middle, heading, -lead), speed, heading)


def chasers(trip: Trip, rng: np.random.Generator) -> Iterator[Obstacle]:
    """Obstacles that aim every 1.5 s at where they can meet the robot's straight trip."""
    for _ in range(int(rng.integers(4, 8))):
        side = 1.0 if rng.random() < 0.5 else -1.0
        center = trip.beside(rng.uniform(2.0, trip.length_m - 1.0), side * rng.uniform(1.0, 4.0))
        speed = trip.speed_mps * rng.uniform(*_SPEEDS)
        yield _chaser(trip, center, speed, rng)


def _chaser(trip: Trip, center: Point, speed: float, rng: np.random.Generator) -> Obstacle:
    every_s, end_s = 1.5, 1.5 * trip.time_s
    segments: list[Turn] = []
    position, t = center, 0.0
    while t < end_s:
        heading = _lead(trip, position, t, speed) + rng.normal(0.0, math.radians(8.0))
        segments.append(
            Turn(at_s=t, speed_mps=speed, heading_rad=math.remainder(heading, math.tau))
        )
        position, t = towards(position, heading, speed * every_s), t + every_s
    return Obstacle(
        center_m=center,
        radius_m=OBSTACLE_RADIUS_M,
        speed_mps=speed,
        heading_rad=segments[0].heading_rad,
        turns=tuple(segments[1:]),
    )


def _lead(trip: Trip, position: Point, t: float, speed: float) -> float:
    """Heading to the first point of the trip reachable in time, else to the robot."""
    ahead = t
    while ahead < trip.time_s:
        if distance(position, trip.at(ahead)) <= speed * (ahead - t):
            return bearing(position, trip.at(ahead))
        ahead += 0.1
    return bearing(position, trip.at(t))


def corridor(trip: Trip, rng: np.random.Generator) -> Iterator[Obstacle]:
    """Two rows of posts along the trip, with obstacles coming towards the robot between them."""
    half = rng.uniform(1.3, 1.8)
    for k in range(12):
        for side in (1.0, -1.0):
            yield _mover(trip.beside(3.0 + 0.75 * k, side * half), 0.0, 0.0)
    for _ in range(int(rng.integers(1, 4))):
        side = 1.0 if rng.random() < 0.5 else -1.0
        speed = trip.speed_mps * rng.uniform(*_SPEEDS)
        aside = side * rng.uniform(0.3, half - ENLARGED_M)
        yield _mover(trip.beside(rng.uniform(8.0, 18.0), aside), speed, trip.heading(math.pi))


def closing_gap(trip: Trip, rng: np.random.Generator) -> Iterator[Obstacle]:
    """Two rows that close across the trip, at about the time the robot arrives."""
    along = rng.uniform(5.0, 12.0)
    shut_s = along / trip.speed_mps * rng.uniform(0.6, 1.2)
    speed = trip.speed_mps * rng.uniform(*_SPEEDS)
    each = int(rng.integers(3, 7))
    for side in (1.0, -1.0):
        for k in range(each):
            across = ENLARGED_M + speed * shut_s + 0.7 * k
            inwards = trip.heading(-side * math.pi / 2.0)
            yield _mover(trip.beside(along, side * across), speed, inwards)


FAMILIES: dict[str, Family] = {
    "pincers": pincers,
    "streams": streams,
    "chasers": chasers,
    "corridor": corridor,
    "closing-gap": closing_gap,
}


def adversarial_obstacles(
    family: str, trip: Trip, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """The obstacles of a world of this family, without those too near start or goal at t = 0."""
    return tuple(
        obstacle
        for obstacle in FAMILIES[family](trip, rng)
        if leaves_room(obstacle.center_m, obstacle.radius_m, _MARGIN_M)
    )


def _mover(center: Point, speed: float, heading_rad: float) -> Obstacle:
    return Obstacle(
        center_m=center,
        radius_m=OBSTACLE_RADIUS_M,
        speed_mps=speed,
        heading_rad=math.remainder(heading_rad, math.tau),
    )
