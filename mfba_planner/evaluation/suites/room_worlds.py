# SPDX-License-Identifier: Apache-2.0
"""Worlds of walls: doors, corridors, U, long walls, mazes and furniture, in turn.

Each is drawn in a frame of its own, then turned by a random angle and mirrored or not. By
construction there is a way at least 0.1 m wider than the robot, and start and goal are 0.1 m or
more from everything (both less the rounding of coordinates to 0.1 mm).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...core.geometry import Point, distance
from ...core.segments import Segment
from ...simulation.obstacle_motion import Obstacle
from ...simulation.scenario import Scenario
from .maze import maze_walls
from .task_geometry import ROBOT_RADIUS_M

SPARE_M = 0.1  # of every way, beyond the robot's width; of start and goal, beyond its radius
NARROWEST_M = 2.0 * ROBOT_RADIUS_M + SPARE_M
FREE_M = ROBOT_RADIUS_M + SPARE_M  # of start and goal
MAZE_CELL_M = 1.5
LEG_RADIUS_M = 0.03  # of a table
_DIGITS = 4  # of coordinates


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Start, goal and what stands, in metres: wall segments and posts (x, y, radius)."""

    start_m: Point
    goal_m: Point
    segments_m: tuple[Segment, ...]
    posts: tuple[tuple[float, float, float], ...] = ()


Family = Callable[[np.random.Generator], Place]


def door(rng: np.random.Generator) -> Place:
    """A closed hall of 11 x 7 m; one or two walls across it, each with a door of 0.7 to 1.2 m."""
    half, walls = 3.5, [*_box(4.0, 0.0, 11.0, 7.0)]
    first, apart = rng.uniform(2.5, 3.5), rng.uniform(1.6, 2.4)
    for number in range(int(rng.integers(1, 3))):
        x = first + number * apart
        wide, middle = rng.uniform(NARROWEST_M, 1.2), rng.uniform(-2.6, 2.6)
        walls += [(x, -half, x, middle - 0.5 * wide), (x, middle + 0.5 * wide, x, half)]
    start, goal = rng.uniform(-2.5, 2.5, 2).tolist()
    return Place(start_m=(0.0, start), goal_m=(8.0, goal), segments_m=tuple(walls))


def corridor(rng: np.random.Generator) -> Place:
    """A corridor of 0.8 to 1.4 m, closed at both ends, with one or two bends of 45 to 110 deg."""
    wide, heading = rng.uniform(2.0 * FREE_M, 1.4), 0.0
    middle: list[Point] = [(0.0, 0.0)]
    for _ in range(int(rng.integers(2, 4))):
        length, (x, y) = rng.uniform(3.5, 5.0), middle[-1]
        middle.append((x + length * math.cos(heading), y + length * math.sin(heading)))
        # The second bend is to the other side, or a long corridor might cross itself.
        side = -math.copysign(1.0, heading) if heading else 1.0
        heading += side * math.radians(rng.uniform(45.0, 110.0))
    left, right = _beside(middle, 0.5 * wide), _beside(middle, -0.5 * wide)
    start, goal = _towards(middle[0], middle[1], 0.6), _towards(middle[-1], middle[-2], 0.6)
    return Place(start_m=start, goal_m=goal, segments_m=_chain([*left, *reversed(right), left[0]]))


def u_trap(rng: np.random.Generator) -> Place:
    """A U of 1.6 x 0.8 to 4 x 3 m that opens to the start, which is before it or in it."""
    half, deep = 0.5 * rng.uniform(1.6, 4.0), rng.uniform(0.8, 3.0)
    behind, aside = rng.uniform(FREE_M + 0.2, deep + 2.0), rng.uniform(-1.0, 1.0)
    aside *= half - FREE_M
    corners = [(behind - deep, half), (behind, half), (behind, -half), (behind - deep, -half)]
    walls = _chain([(x, y - aside) for x, y in corners])
    return Place(start_m=(0.0, 0.0), goal_m=(behind + rng.uniform(1.5, 4.0), 0.0),
                 segments_m=walls)  # fmt: skip


def long_wall(rng: np.random.Generator) -> Place:
    """A wall of 2 to 6 m across the straight line, up to 30 deg aslant."""
    long, slant = rng.uniform(2.0, 6.0), math.radians(rng.uniform(-30.0, 30.0))
    x, share = rng.uniform(2.5, 4.0), rng.uniform(0.25, 0.75)
    dx, dy = long * math.sin(slant), long * math.cos(slant)
    wall = (x - share * dx, -share * dy, x + (1.0 - share) * dx, (1.0 - share) * dy)
    return Place(start_m=(0.0, 0.0), goal_m=(x + rng.uniform(2.5, 4.0), 0.0), segments_m=(wall,))


def maze(rng: np.random.Generator) -> Place:
    """A maze of 4 x 4 or 5 x 5 cells of 1.5 m, from one corner to the opposite one."""
    cells = int(rng.integers(4, 6))
    walls = tuple(
        (MAZE_CELL_M * a, MAZE_CELL_M * b, MAZE_CELL_M * c, MAZE_CELL_M * d)
        for a, b, c, d in maze_walls(cells, cells, int(rng.integers(0, 3)), rng)
    )
    end = MAZE_CELL_M * (cells - 0.5)
    return Place(start_m=(0.5 * MAZE_CELL_M,) * 2, goal_m=(end, end), segments_m=walls)


def furniture(rng: np.random.Generator) -> Place:
    """A closed room of 9 x 7 m with boxes, and tables whose four legs alone stand.

    Circles round the pieces leave NARROWEST_M between each other and to the walls.
    """
    start, goal = (0.0, rng.uniform(-2.5, 2.5)), (7.4, rng.uniform(-2.5, 2.5))
    middle_x = 3.7
    walls = [*_box(middle_x, 0.0, 9.0, 7.0)]
    posts: list[tuple[float, float, float]] = []
    taken: list[tuple[Point, float]] = []
    for _ in range(60):
        is_table = rng.random() < 0.4
        long, short = (rng.uniform(1.2, 1.8), rng.uniform(0.8, 1.0)) if is_table else (
            rng.uniform(0.4, 1.4), rng.uniform(0.3, 0.8))  # fmt: skip
        around = 0.5 * math.hypot(long, short) + LEG_RADIUS_M
        free_x, free_y = 4.5 - around - NARROWEST_M, 3.5 - around - NARROWEST_M
        center = (middle_x + rng.uniform(-free_x, free_x), rng.uniform(-free_y, free_y))
        turn = rng.uniform(-math.pi, math.pi)
        if any(distance(center, end) < around + FREE_M for end in (start, goal)):
            continue
        if any(distance(center, c) < around + r + NARROWEST_M for c, r in taken):
            continue
        taken.append((center, around))
        box = _box(*center, long, short, turn)
        if is_table:
            posts += [(x, y, LEG_RADIUS_M) for x, y, _, _ in box]
        else:
            walls += box
    return Place(start_m=start, goal_m=goal, segments_m=tuple(walls), posts=tuple(posts))


FAMILIES: dict[str, Family] = {
    "door": door,
    "corridor": corridor,
    "u-trap": u_trap,
    "long-wall": long_wall,
    "maze": maze,
    "furniture": furniture,
}


def room_scenario(name: str, family: str, rng: np.random.Generator) -> Scenario:
    """A world of this family."""
    place = FAMILIES[family](rng)
    turn, side = rng.uniform(-math.pi, math.pi), 1.0 if rng.random() < 0.5 else -1.0
    cos, sin = math.cos(turn), math.sin(turn)

    def placed(x: float, y: float) -> Point:
        return (
            round(x * cos - side * y * sin, _DIGITS) + 0.0,  # + 0.0: no -0.0
            round(x * sin + side * y * cos, _DIGITS) + 0.0,
        )

    return Scenario(
        name=name,
        start_m=placed(*place.start_m),
        goal_m=placed(*place.goal_m),
        robot_radius_m=ROBOT_RADIUS_M,
        obstacles=tuple(Obstacle(center_m=placed(x, y), radius_m=r) for x, y, r in place.posts),
        segments_m=tuple((*placed(a, b), *placed(c, d)) for a, b, c, d in place.segments_m),
    )


def _chain(points: Iterable[Point]) -> tuple[Segment, ...]:
    return tuple((*a, *b) for a, b in pairwise(points))


def _box(x: float, y: float, long: float, short: float, turn: float = 0.0) -> tuple[Segment, ...]:
    """The four sides of a rectangle round (x, y)."""
    ax, ay = 0.5 * long * math.cos(turn), 0.5 * long * math.sin(turn)
    bx, by = -0.5 * short * math.sin(turn), 0.5 * short * math.cos(turn)
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))
    return _chain([(x + a * ax + b * bx, y + a * ay + b * by) for a, b in signs])


def _beside(middle: list[Point], aside: float) -> list[Point]:
    """A polyline parallel to another one, to its left; corners are where the sides meet."""
    headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(middle)]
    found = []
    for (x, y), before, after in zip(middle, [headings[0], *headings], [*headings, headings[-1]]):
        bend = math.remainder(after - before, math.tau)
        out, far = before + 0.5 * bend + 0.5 * math.pi, aside / math.cos(0.5 * bend)
        found.append((x + far * math.cos(out), y + far * math.sin(out)))
    return found


def _towards(a: Point, b: Point, by_m: float) -> Point:
    share = by_m / distance(a, b)
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
