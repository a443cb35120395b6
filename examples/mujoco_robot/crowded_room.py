# SPDX-License-Identifier: Apache-2.0
"""A room with walls, pillars and people who walk among waypoints: a Scenario for both engines.

The room is 12 x 12 m. Whatever stands keeps 1.3 m to all else, so that the robot passes
everywhere. People walk at a speed of their own, among waypoints or to and fro across the room;
they see neither the robot nor each other, and walk round nothing but walls and pillars.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from mfba_planner.core.geometry import Point, distance
from mfba_planner.core.robot_base import Drive
from mfba_planner.core.segments import Segment, Segments
from mfba_planner.simulation.footprint import FootprintCircle
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.recorded_motion import Knot
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.scenario import Kidnapping, Scenario

SIDE_M = 12.0
BODY_RADIUS_M = 0.25  # of the robot, and of a person
ROBOT_RADIUS_M = 0.3  # for the planner: with a margin for errors of the pose
PEOPLE = 10
SPEEDS_MPS = (0.5, 1.5)
TIME_LIMIT_S = 90.0
WALL_M = 0.1  # thickness
APART_M = 1.3  # between all that stands
SPEED_MPS = 1.2  # of the robot
LIDAR = Lidar(beams=360, range_max_m=8.0)
RANGE_SD_M = 0.01
_PILLARS, _WALLS = 4, 3
_KEPT_FREE_M = 2.0  # centre to centre, between the robot's start and people at the beginning
_FREE_M = BODY_RADIUS_M + 0.1  # between the centre of a person and what stands
_ACROSS_M = 8.0  # the shortest way to and fro
_DIGITS = 4


class Walk(Enum):
    """How people walk: to random waypoints, with sharp turns, or straight across and back."""

    WAYPOINTS = "waypoints"
    STRAIGHT = "straight"


class Box(NamedTuple):
    """A wall inside the room, along the axes: centre and half sizes (m)."""

    x: float
    y: float
    half_x: float
    half_y: float

    @property
    def outline(self) -> tuple[Segment, ...]:
        """Its four sides."""
        x0, x1 = self.x - self.half_x, self.x + self.half_x
        y0, y1 = self.y - self.half_y, self.y + self.half_y
        return ((x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0))


class Standing(NamedTuple):
    """What stands in the room, inside its border."""

    boxes: tuple[Box, ...] = ()
    pillars: tuple[Obstacle, ...] = ()

    @property
    def sides(self) -> tuple[Segment, ...]:
        """The outlines of all boxes."""
        return tuple(side for box in self.boxes for side in box.outline)

    def clearance_m(self, point: Point) -> float:
        """Distance from a point to the nearest wall or pillar."""
        x, y = point
        if any(abs(x - box.x) < box.half_x and abs(y - box.y) < box.half_y for box in self.boxes):
            return 0.0
        to_walls = float(Segments.of([*BORDER, *self.sides]).distances(x, y).min())
        return min([to_walls, *(distance(point, p.center_m) - p.radius_m for p in self.pillars)])

    def is_free(self, a: Point, b: Point, free_m: float) -> bool:
        """Whether a straight walk keeps off all that stands."""
        start = np.array([a[0]]), np.array([a[1]])
        moved = np.array([b[0] - a[0]]), np.array([b[1] - a[1]])
        swept = Segments.of(list(self.sides)).swept_distances(*start, *moved)
        if float(swept.min()) < free_m:
            return False
        walk = Segments.of([(*a, *b)])
        return all(
            float(walk.distances(*p.center_m)[0]) >= p.radius_m + free_m for p in self.pillars
        )


class Room(NamedTuple):
    """A task, and the boxes whose outlines are the scenario's segments after the room's four."""

    scenario: Scenario
    boxes: tuple[Box, ...]
    people: int


BORDER: tuple[Segment, ...] = (
    (0.0, 0.0, SIDE_M, 0.0),
    (SIDE_M, 0.0, SIDE_M, SIDE_M),
    (SIDE_M, SIDE_M, 0.0, SIDE_M),
    (0.0, SIDE_M, 0.0, 0.0),
)


def draw_room(
    number: int,
    *,
    people: int = PEOPLE,
    walk: Walk = Walk.WAYPOINTS,
    kidnapped: bool = False,
) -> Room:
    """World of that number; the same at every call.

    With kidnapped the robot is put elsewhere after 4 to 10 s, to a place where nobody is then.
    """
    rng = np.random.default_rng((20, number))
    standing = _draw_what_stands(rng)
    start, goal = _ends(rng, standing)
    walkers = [_person(rng, walk, standing, (start, goal)) for _ in range(people)]
    scenario = Scenario(
        name=f"room{number}",
        start_m=start,
        goal_m=goal,
        robot_radius_m=ROBOT_RADIUS_M,
        obstacles=(*walkers, *standing.pillars),
        time_limit_s=TIME_LIMIT_S,
        robot=Robot(
            drive=Drive.DIFFERENTIAL,
            max_speed_mps=SPEED_MPS,
            lidar=LIDAR,
            noise=Noise(scan_m=RANGE_SD_M),
            footprint_m=(FootprintCircle(0.0, 0.0, BODY_RADIUS_M),),
        ),
        segments_m=(*BORDER, *standing.sides),
    )
    if kidnapped:
        scenario = _with_kidnapping(scenario, rng, standing)
    return Room(scenario, standing.boxes, people)


def _draw_what_stands(rng: np.random.Generator) -> Standing:
    found = Standing()
    while len(found.boxes) < _WALLS:
        half = 0.5 * float(rng.uniform(1.5, 3.5))
        x, y = rng.uniform(2.0, SIDE_M - 2.0, size=2).round(_DIGITS).tolist()
        half, thin = round(half, _DIGITS), 0.5 * WALL_M
        box = Box(x, y, half, thin) if rng.random() < 0.5 else Box(x, y, thin, half)
        steps = np.linspace(-1.0, 1.0, 9).tolist()
        along = [(x + s * box.half_x, y + s * box.half_y) for s in steps]
        if all(found.clearance_m(point) >= APART_M + WALL_M for point in along):
            found = found._replace(boxes=(*found.boxes, box))
    while len(found.pillars) < _PILLARS:
        x, y = rng.uniform(1.5, SIDE_M - 1.5, size=2).round(_DIGITS).tolist()
        radius = round(float(rng.uniform(0.15, 0.3)), _DIGITS)
        if found.clearance_m((x, y)) >= APART_M + radius:
            pillar = Obstacle(center_m=(x, y), radius_m=radius)
            found = found._replace(pillars=(*found.pillars, pillar))
    return found


def _ends(rng: np.random.Generator, standing: Standing) -> tuple[Point, Point]:
    """A start in one corner and a goal in the opposite one."""
    found: list[Point] = []
    while len(found) < 2:
        x, y = rng.uniform(0.8, 2.5, size=2).round(_DIGITS).tolist()
        point = (SIDE_M - x, SIDE_M - y) if found else (x, y)
        if standing.clearance_m(point) >= ROBOT_RADIUS_M + 0.3:
            found.append(point)
    return found[0], found[1]


def _person(
    rng: np.random.Generator,
    walk: Walk,
    standing: Standing,
    ends: tuple[Point, Point],
) -> Obstacle:
    """One who walks for the whole time, and is not near the robot's start or goal at first."""
    speed = float(rng.uniform(*SPEEDS_MPS))
    route = (_to_and_fro if walk is Walk.STRAIGHT else _among_waypoints)(rng, standing, ends)
    here, t_s = next(route), 0.0
    knots: list[Knot] = [(t_s, *here)]
    while t_s < TIME_LIMIT_S:
        there = next(route)
        t_s = round(t_s + distance(here, there) / speed, _DIGITS)
        here = there
        knots.append((t_s, *here))
    return Obstacle(center_m=knots[0][1:], radius_m=BODY_RADIUS_M, trajectory=tuple(knots))


def _point(rng: np.random.Generator) -> Point:
    x, y = rng.uniform(0.5, SIDE_M - 0.5, size=2).round(_DIGITS).tolist()
    return x, y


def _among_waypoints(
    rng: np.random.Generator,
    standing: Standing,
    ends: tuple[Point, Point],
) -> Iterator[Point]:
    here = _point(rng)
    while _near(here, ends) or standing.clearance_m(here) < _FREE_M:
        here = _point(rng)
    yield here
    while True:
        there = _point(rng)
        if distance(here, there) >= 1.0 and standing.is_free(here, there, _FREE_M):
            here = there
            yield here


def _to_and_fro(
    rng: np.random.Generator,
    standing: Standing,
    ends: tuple[Point, Point],
) -> Iterator[Point]:
    """From a point of a line across the room to one of its ends, to the other one, and so on."""
    while True:
        a, b, share = _point(rng), _point(rng), float(rng.random())
        here = (
            round(a[0] + share * (b[0] - a[0]), _DIGITS),
            round(a[1] + share * (b[1] - a[1]), _DIGITS),
        )
        if (
            distance(a, b) >= _ACROSS_M
            and 0.1 < share < 0.9
            and not _near(here, ends)
            and standing.is_free(a, b, _FREE_M)
        ):
            break
    yield here
    while True:
        yield b
        yield a


def _near(point: Point, ends: tuple[Point, Point]) -> bool:
    return min(distance(point, end) for end in ends) < _KEPT_FREE_M


def _with_kidnapping(scenario: Scenario, rng: np.random.Generator, standing: Standing) -> Scenario:
    at_s = round(float(rng.uniform(4.0, 10.0)), 1)
    centers = scenario.centers(at_s)
    while True:
        x, y = rng.uniform(0.8, SIDE_M - 0.8, size=2).round(_DIGITS).tolist()
        people_off = min((math.dist((x, y), center) for center in centers), default=math.inf)
        far = distance((x, y), scenario.start_m) > 3.0 and distance((x, y), scenario.goal_m) > 3.0
        if (
            far
            and people_off > _KEPT_FREE_M
            and (standing.clearance_m((x, y)) >= ROBOT_RADIUS_M + 0.2)
        ):
            return replace(scenario, kidnappings=(Kidnapping(at_s=at_s, to_m=(x, y)),))
