# SPDX-License-Identifier: Apache-2.0
"""People in a hall, by social forces among walls; they do not see the robot.

A hall of 18 x 8 m, open at both ends, with a wall across its middle that has two doors, and round
pillars. People come in through both ends, go through the nearer or the other door and leave at the
far end. Walls and pillars repel people as in Helbing, Molnar (1995), eq. 5, with their constants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...core.errors import ConfigError
from ...core.geometry import Point
from ...core.option_specs import check, option
from ...core.segments import Segment, Segments
from ...simulation.obstacle_motion import Obstacle
from ...simulation.scenario import Scenario
from .social_forces import (
    DIGITS,
    SPEED_MPS,
    SPEED_SD_MPS,
    STEP_S,
    Array,
    desire,
    next_velocity,
    obstacle_of,
)
from .task_geometry import ROBOT_RADIUS_M

BORDER_M2PS2, BORDER_RANGE_M = 10.0, 0.2  # U0, R
HALF_LENGTH_M, HALF_WIDTH_M = 9.0, 4.0
PILLAR_RADIUS_M = 0.3
START_M: Point = (-6.0, 0.0)
GOAL_M: Point = (6.0, 0.0)
_NEAR_M = 0.5  # on both sides of a door, where a person walks straight through it
_DIGITS = 4  # of the coordinates of doors and pillars


@dataclass(frozen=True, slots=True, kw_only=True)
class HallParams:
    """Numbers of people and pillars, and widths of the doors."""

    people: int = option(14, "number of people", minimum=0, maximum=200)
    pillars: int = option(4, "number of pillars", minimum=0, maximum=20)
    radius_m: float = option(0.25, "radius of a person", unit="m", minimum=0.05, maximum=0.5)
    door_min_m: float = option(1.6, "narrowest door", unit="m", minimum=0.7, maximum=3.0)
    door_max_m: float = option(2.4, "widest door", unit="m", minimum=0.7, maximum=3.0)
    until_s: float = option(
        45.0, "time until which people see each other and the walls; then they go on straight",
        unit="s", minimum=1.0, maximum=200.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range, or a maximum below its minimum."""
        check(self)
        if self.door_min_m > self.door_max_m:
            raise ConfigError(
                f"door_min_m={self.door_min_m:g}: above door_max_m={self.door_max_m:g}; "
                "give the smaller one first"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Hall:
    """What stands: walls, doors as (middle, width) along y at x = 0, and centres of pillars."""

    segments_m: tuple[Segment, ...]
    doors: tuple[tuple[float, float], ...]
    pillars_m: tuple[Point, ...]


def hall_scenario(name: str, params: HallParams, rng: np.random.Generator) -> Scenario:
    """A world of the suite: the hall, and people at 1.3 m/s on average."""
    hall = draw_hall(params, rng)
    paths = people_paths(params, hall, rng)
    people = [obstacle_of(path, STEP_S, params.radius_m) for path in paths.tolist()]
    pillars = [Obstacle(center_m=c, radius_m=PILLAR_RADIUS_M) for c in hall.pillars_m]
    return Scenario(
        name=name,
        start_m=START_M,
        goal_m=GOAL_M,
        robot_radius_m=ROBOT_RADIUS_M,
        obstacles=tuple(people + pillars),
        segments_m=hall.segments_m,
    )


def draw_hall(params: HallParams, rng: np.random.Generator) -> Hall:
    """A door in each half of the wall across, and pillars on two lines across the hall."""
    doors = []
    for side in (-1.0, 1.0):
        wide = rng.uniform(params.door_min_m, params.door_max_m)
        middle = side * rng.uniform(0.5 * wide + 0.3, HALF_WIDTH_M - 0.5 * wide - 0.4)
        doors.append((round(middle, _DIGITS), round(wide, _DIGITS)))
    pillars: list[Point] = []
    for number in range(params.pillars):
        x = (-1.0, 1.0)[number % 2] * rng.uniform(2.2, 3.8)
        y = (-1.0, 1.0)[number // 2 % 2] * rng.uniform(0.6, 2.6)
        pillars.append((round(x, _DIGITS), round(y, _DIGITS)))
    ends = [-HALF_WIDTH_M]
    for middle, wide in doors:
        ends += [round(middle - 0.5 * wide, _DIGITS), round(middle + 0.5 * wide, _DIGITS)]
    across = [(0.0, a, 0.0, b) for a, b in zip(ends[::2], [*ends[1::2], HALF_WIDTH_M])]
    sides = [(-HALF_LENGTH_M, y, HALF_LENGTH_M, y) for y in (-HALF_WIDTH_M, HALF_WIDTH_M)]
    return Hall(segments_m=(*sides, *across), doors=tuple(doors), pillars_m=tuple(pillars))


def people_paths(params: HallParams, hall: Hall, rng: np.random.Generator) -> Array:
    """Positions (n, K, 2) of all people at steps of STEP_S.

    They start up to 20 s of walking before the wall across, so that they come as long as the
    robot drives; none is within 0.8 m of the robot's start or goal, of a pillar or of another
    person at t = 0.
    """
    starts: list[Point] = []
    gates: list[Point] = []
    ahead: list[float] = []
    speeds: list[float] = []
    kept_free = [(START_M, 1.1), (GOAL_M, 1.1)] + [(c, 0.8) for c in hall.pillars_m]
    while len(starts) < params.people:
        sign = 1.0 if rng.random() < 0.5 else -1.0
        start = (-sign * rng.uniform(1.0, 26.0), rng.uniform(-3.4, 3.4))
        middle, wide = hall.doors[int(rng.integers(len(hall.doors)))]
        reach = max(0.0, 0.5 * wide - 0.6)
        gate = (0.0, middle + rng.uniform(-reach, reach))
        speed = SPEED_MPS + SPEED_SD_MPS * min(max(rng.normal(), -2.0), 2.0)
        others = [(other, 0.8) for other in starts]
        if all(math.dist(start, c) >= free for c, free in kept_free + others):
            starts.append(start)
            gates.append(gate)
            ahead.append(sign)
            speeds.append(speed)
    return _walk(params, hall, *map(np.array, (starts, gates, ahead, speeds)))


def _walk(
    params: HallParams, hall: Hall, starts: Array, gates: Array, ahead: Array, speeds: Array
) -> Array:
    """Towards the gates (n, 2), through them, then along the hall; ahead (n,) is 1 or -1 along x.

    A target is always ahead of a person: one that is passed would draw him back.
    """
    position = np.round(starts.reshape(-1, 2), DIGITS)
    gates = gates.reshape(-1, 2)
    through = gates + np.stack([2.0 * _NEAR_M * ahead, 0.0 * ahead], axis=1)
    beyond = np.stack([60.0 * ahead, 0.7 * gates[:, 1]], axis=1)
    velocity = np.round(speeds[:, None] * np.stack([ahead, 0.0 * ahead], axis=1), DIGITS)
    found, borders = [position], Borders(hall)
    for _ in range(round(params.until_s / STEP_S)):
        along = (position[:, 0] * ahead)[:, None]
        targets = np.where(along < -_NEAR_M, gates, np.where(along < _NEAR_M, through, beyond))
        force = desire(position, velocity, targets, speeds) + borders.repulsion(position)
        velocity = next_velocity(velocity, force, speeds)
        moved = borders.outside(position + STEP_S * velocity, params.radius_m)
        position = np.round(moved, DIGITS)
        found.append(position)
    paths: Array = np.moveaxis(np.array(found), 1, 0)
    return paths


class Borders:
    """Walls and pillars as what repels people."""

    def __init__(self, hall: Hall) -> None:
        """Take the walls and pillars of a hall."""
        self.segments = Segments.of(hall.segments_m)
        self.pillars = np.array(hall.pillars_m).reshape(-1, 2)

    def repulsion(self, position: Array) -> Array:
        """Eq. 5: the sum over all borders of -grad U0 exp(-d / R), (n, 2)."""
        away, distance = self._from_nearest(position)
        strength = BORDER_M2PS2 / BORDER_RANGE_M * np.exp(-distance / BORDER_RANGE_M)
        total: Array = (strength[..., None] * away).sum(axis=1)
        return total

    def outside(self, position: Array, radius_m: float) -> Array:
        """The positions (n, 2), moved straight out of the borders that a person would touch."""
        for _ in range(3):  # out of one may be into another, in a corner
            away, distance = self._from_nearest(position)
            into = np.maximum(radius_m - distance, 0.0)
            deepest = into.argmax(axis=1)[:, None]
            into = np.take_along_axis(into, deepest, axis=1)
            position = position + into * np.take_along_axis(away, deepest[..., None], axis=1)[:, 0]
        return position

    def _from_nearest(self, position: Array) -> tuple[Array, Array]:
        """Unit vectors (n, b, 2) from, and distances (n, b) to the nearest points of borders."""
        s, (x, y) = self.segments, position.T[:, :, None]
        share = ((x - s.x) * s.dx + (y - s.y) * s.dy) / (s.dx * s.dx + s.dy * s.dy)
        share = np.clip(share, 0.0, 1.0)
        walls = np.stack([x - s.x - share * s.dx, y - s.y - share * s.dy], axis=-1)
        posts = position[:, None] - self.pillars
        away = np.concatenate([walls, posts], axis=1)
        length = np.maximum(np.hypot(away[..., 0], away[..., 1]), 1e-9)
        radii = np.repeat([0.0, PILLAR_RADIUS_M], [walls.shape[1], posts.shape[1]])
        return away / length[..., None], length - radii
