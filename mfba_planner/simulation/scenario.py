# SPDX-License-Identifier: Apache-2.0
"""Scenario: start, goal, robot, obstacles, walls, time limit, kidnappings, fleet; checked."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

from ..core.errors import ConfigError
from ..core.geometry import Point, Pose2D, distance
from ..core.planner_types import ROBOT_RADIUS_M
from ..core.segments import Segment, Segments, segments_of
from ..planning.planner_params import PlannerParams
from .footprint import circles_at, circumscribed_radius_m, inscribed_radius_m
from .obstacle_motion import Obstacle, Walls, center_at
from .recorded_motion import check_motion, is_present
from .robot_model import Robot
from .triggered_motion import at_start, check_trigger

TOUCH_M = 1e-9  # a robot that starts in touch with a wall is not inside it
NOWHERE: Point = (math.nan, math.nan)  # centre of an obstacle that is absent


@dataclass(frozen=True, slots=True, kw_only=True)
class Kidnapping:
    """At the first tick from at_s (s) on, the robot is moved to to_m (m); its heading is kept."""

    at_s: float
    to_m: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetRobot:
    """One robot of a fleet: its name, which is its ROS namespace, its start and its goal (m)."""

    name: str
    start_m: Point
    goal_m: Point

    def __post_init__(self) -> None:
        """Raise ConfigError for a name that is no ROS namespace, or a goal equal to the start."""
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*", self.name):
            raise ConfigError(
                f"robot {self.name!r}: not a ROS namespace; give letters, digits and single _, "
                "a letter first"
            )
        if self.start_m == self.goal_m:
            raise ConfigError(
                f"robot {self.name} goal_m={list(self.goal_m)}: equal to start_m; move one of them"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A task: start, goal, robot, obstacles, walls and a limit of simulated time.

    segments_m are static walls that the robot touches and its lidar detects; walls is a rectangle
    that obstacles bounce from and the robot may cross. Moving obstacles pass through segments.
    With robots it is the task of a fleet (fleet.py); start_m and goal_m are its first robot's.
    robot_radius_m is what planners keep clear; with a footprint (robot.footprint_m) its circles
    are what touches, and robot_radius_m is at least the radius around all of them.
    """

    name: str
    start_m: Point
    goal_m: Point
    robot_radius_m: float = ROBOT_RADIUS_M
    obstacles: tuple[Obstacle, ...] = ()
    walls: Walls | None = None
    time_limit_s: float = 120.0
    description: str = ""
    robot: Robot = Robot()
    kidnappings: tuple[Kidnapping, ...] = ()
    robots: tuple[FleetRobot, ...] = ()
    segments_m: tuple[Segment, ...] = ()

    @property
    def segments(self) -> Segments:
        """The wall segments as arrays."""
        return segments_of(self.segments_m)

    @property
    def robot_names(self) -> tuple[str, ...]:
        """Names of the robots of a fleet; empty for a single robot."""
        return tuple(member.name for member in self.robots)

    def __post_init__(self) -> None:
        """Raise ConfigError for a task that is invalid at t = 0."""
        if self.start_m == self.goal_m:
            raise ConfigError(f"goal_m={list(self.goal_m)}: equal to start_m; move one of them")
        _check_footprint(self)
        for number, obstacle in enumerate(self.obstacles, start=1):
            motion = obstacle.trigger.motion if obstacle.trigger else obstacle
            check_motion(number, motion)
            if obstacle.trigger:
                check_trigger(number, obstacle.trigger)
            _check_start(self, number, at_start(obstacle, self.start_m))
            if self.walls is not None and not motion.trajectory:
                _check_inside(number, motion, self.walls)
            _check_turns(number, motion)
        _check_kidnappings(self)
        if self.segments_m:
            _check_place(self)
        if self.robots:
            _check_fleet(self)

    def planner_params(self, params: PlannerParams) -> PlannerParams:
        """The options of a planner, for this scenario's robot."""
        return params.for_robot(self.robot_radius_m, self.robot.base)

    def robot_circles(self, pose: Pose2D) -> list[tuple[Point, float]]:
        """(centre, radius) in metres of what the robot covers at a pose: footprint, or disc."""
        footprint = self.robot.footprint_m
        return circles_at(footprint, pose) if footprint else [(pose.position, self.robot_radius_m)]

    def gap_m(self, pose: Pose2D, center: Point, radius_m: float) -> float:
        """Gap between the robot's edge at a pose and a circle, edge to edge; < 0 in contact."""
        return _gap_m(self.robot_circles(pose), center, radius_m)

    def enlarged_radius(self, obstacle: Obstacle) -> float:
        """Obstacle radius plus robot radius (Fig. 4), metres."""
        return obstacle.radius_m + self.robot_radius_m

    def centers(self, t_s: float) -> list[Point]:
        """Centres of all obstacles at time t, in scenario order; NaN of one that is absent."""
        return [
            center_at(obstacle, t_s, self.walls) if is_present(obstacle, t_s) else NOWHERE
            for obstacle in self.obstacles
        ]

    def enlarged(self, t_s: float) -> list[tuple[Point, float]]:
        """(centre, enlarged radius) of all obstacles at time t; centres as in centers()."""
        return list(zip(self.centers(t_s), map(self.enlarged_radius, self.obstacles)))


def _gap_m(circles: list[tuple[Point, float]], center: Point, radius_m: float) -> float:
    """The least gap between circles (centre, radius) and another, edge to edge."""
    return min(distance(own, center) - (radius_m + radius) for own, radius in circles)


def _check_footprint(scenario: Scenario) -> None:
    least_m = circumscribed_radius_m(scenario.robot.footprint_m)
    if scenario.robot_radius_m < least_m - TOUCH_M:
        raise ConfigError(
            f"robot_radius_m={scenario.robot_radius_m:g}: robot.footprint_m reaches "
            f"{least_m:.12g} m from base_link; give at least that, or leave robot_radius_m out"
        )


def _circles_later(scenario: Scenario, point: Point) -> list[tuple[Point, float]]:
    """What the robot surely covers at a point that it reaches with a heading not known before."""
    footprint = scenario.robot.footprint_m
    if footprint and scenario.robot.turns:
        return [(point, inscribed_radius_m(footprint))]
    return scenario.robot_circles(Pose2D(*point))


def _check_start(scenario: Scenario, number: int, obstacle: Obstacle) -> None:
    if not is_present(obstacle, 0.0):
        return
    center = center_at(obstacle, 0.0) if obstacle.trajectory else obstacle.center_m
    gap = scenario.gap_m(Pose2D(*scenario.start_m), center, obstacle.radius_m)
    if gap < 0.0:
        raise ConfigError(
            f"start_m={list(scenario.start_m)}: the robot starts {-gap:.3g} m inside obstacle "
            f"{number} (radii added); move start_m or the obstacle"
        )


def _check_place(scenario: Scenario) -> None:
    """Raise ConfigError where a segment is a point, or the robot is to be within a wall."""
    for number, (x0, y0, x1, y1) in enumerate(scenario.segments_m, start=1):
        if (x0, y0) == (x1, y1):
            raise ConfigError(
                f"segment {number} [{x0:g}, {y0:g}, {x1:g}, {y1:g}]: of length 0; "
                "give two different ends"
            )
    later = [("goal_m", scenario.goal_m)]
    later += [("kidnapping to_m", kidnapping.to_m) for kidnapping in scenario.kidnappings]
    start = scenario.start_m
    places = [("start_m", start, scenario.robot_circles(Pose2D(*start)))]
    places += [(what, point, _circles_later(scenario, point)) for what, point in later]
    added = "robot.footprint_m" if scenario.robot.footprint_m else "robot_radius_m"
    for what, point, circles in places:
        for center, radius_m in circles:
            near = scenario.segments.near(center, radius_m).distances(*center)
            inside_m = radius_m - float(near.min(initial=math.inf))
            if inside_m > TOUCH_M:
                raise ConfigError(
                    f"{what}={list(point)}: {inside_m:.3g} m inside a wall segment "
                    f"({added} added); move it away from the wall"
                )


def _check_inside(number: int, obstacle: Obstacle, walls: Walls) -> None:
    for axis, value in enumerate(obstacle.center_m):
        low = walls.lower_m[axis] + obstacle.radius_m
        high = walls.upper_m[axis] - obstacle.radius_m
        if not low <= value <= high:
            raise ConfigError(
                f"obstacle {number} center_m={list(obstacle.center_m)}: not inside the walls; "
                "move it or widen the walls"
            )


def _check_turns(number: int, obstacle: Obstacle) -> None:
    _check_ascending(f"obstacle {number} turns", [turn.at_s for turn in obstacle.turns])


def _check_ascending(what: str, times_s: list[float]) -> None:
    for before, at_s in pairwise([0.0, *times_s]):
        if not before < at_s:
            raise ConfigError(
                f"{what}: at_s={at_s:g} does not come after {before:g}; "
                f"sort the {what.split()[-1]} by time, the first after 0"
            )


def _check_kidnappings(scenario: Scenario) -> None:
    _check_ascending("kidnappings", [kidnapping.at_s for kidnapping in scenario.kidnappings])
    for kidnapping in scenario.kidnappings:
        circles = _circles_later(scenario, kidnapping.to_m)
        for number, center in enumerate(scenario.centers(kidnapping.at_s), start=1):
            obstacle = scenario.obstacles[number - 1]
            if obstacle.trigger:
                continue  # where it is then depends on the robot
            gap = _gap_m(circles, center, obstacle.radius_m)
            if gap < 0.0:
                raise ConfigError(
                    f"kidnapping to_m={list(kidnapping.to_m)}: {-gap:.3g} m inside obstacle "
                    f"{number} at {kidnapping.at_s:g} s (radii added); choose a free point"
                )


def _check_fleet(scenario: Scenario) -> None:
    first, wide = scenario.robots[0], 2.0 * scenario.robot_radius_m
    if (scenario.start_m, scenario.goal_m) != (first.start_m, first.goal_m):
        raise ConfigError(
            "robots: start_m and goal_m differ from those of the first robot; leave those two out"
        )
    if scenario.robot.footprint_m:
        raise ConfigError(
            "robots: a fleet with robot.footprint_m not supported; leave one of them out"
        )
    for what in ("walls", "kidnappings"):
        if getattr(scenario, what):
            raise ConfigError(f"robots: a fleet with {what} not supported; leave one of them out")
    for one, other in combinations(scenario.robots, 2):
        if one.name == other.name:
            raise ConfigError(f"robot {one.name}: named twice; give each robot its own name")
        for what in ("start_m", "goal_m"):
            gap = distance(getattr(one, what), getattr(other, what)) - wide
            if gap < 0.0:
                raise ConfigError(
                    f"robots {one.name} and {other.name} {what}: {-gap:.3g} m into each other "
                    "(radii added); move them apart"
                )
    for member in scenario.robots:  # check each as a single robot
        replace(scenario, start_m=member.start_m, goal_m=member.goal_m, robots=())
