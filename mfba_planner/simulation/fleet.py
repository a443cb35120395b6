# SPDX-License-Identifier: Apache-2.0
"""Several robots in one world: each sees the others as circles that move; an Episode of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import Point, Pose2D, bearing, distance, towards
from ..core.types import NANO, Decision, PathPlanner
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..planning.supervised_planner import supervised_algorithm_1
from .differential_drive import command
from .episode import Episode, Outcome
from .nearby_obstacles import Found
from .obstacle_motion import Obstacle, Turn
from .planner_observations import Observe, observe_sectors
from .scenario import Scenario
from .world import World

FLEET_STREAM = 6  # spawn key of the robots' SeedSequence children; one number per purpose
DRIFT_M = 1e-12  # by which a way of straight stretches may miss a pose

MakePlanner = Callable[[int], PathPlanner]  # from a robot's seed


def robot_seed(seed: int, number: int) -> int:
    """The seed of a fleet's robot (from 0) for its planner and its instruments."""
    child = np.random.SeedSequence(seed, spawn_key=(FLEET_STREAM, number))
    return int(child.generate_state(1, np.uint64)[0] >> np.uint64(1))


def alone(scenario: Scenario, number: int) -> Scenario:
    """The scenario of one robot (from 0) of a fleet, without the others."""
    member = scenario.robots[number]
    return replace(
        scenario,
        name=f"{scenario.name}.{member.name}"[:100],
        start_m=member.start_m,
        goal_m=member.goal_m,
        robots=(),
    )


class RobotWorld(World):
    """The world as one robot of a fleet has it: the scenario's obstacles, then the others."""

    def __init__(self, fleet: Fleet, number: int, tolerance_m: float) -> None:
        """Put the robot at its start, at tick 0."""
        seed = robot_seed(fleet.seed, number)
        super().__init__(alone(fleet.scenario, number), fleet.tick_ns, tolerance_m, seed)
        self.name = fleet.scenario.robots[number].name
        self.poses = [self.pose]  # one per tick of the fleet
        self.seed = seed
        self._fleet, self._number = fleet, number
        self._own = len(self.scenario.obstacles)

    @property
    def others(self) -> list[RobotWorld]:
        """The other robots' places, in the scenario's order."""
        return [p for p in self._fleet.robot_worlds if p is not self]

    def near(self, reach_m: float, position: Point | None = None) -> Found:
        """As World.near(); all other robots are in it."""
        names, circles = super().near(reach_m, position)
        wide = 2.0 * self.scenario.robot_radius_m
        others = [(place.pose.position, wide) for place in self.others]
        return [*names, *range(self._own, self._own + len(others))], [*circles, *others]

    def radius_m(self, index: int) -> float:
        """As World.radius_m()."""
        if index < self._own:
            return super().radius_m(index)
        return self.scenario.robot_radius_m

    def velocity(self, index: int) -> Point:
        """As World.velocity(); a robot's is that of its last tick: the next is not decided yet."""
        if index < self._own:
            return super().velocity(index)
        return self.others[index - self._own].moved

    @property
    def moved(self) -> Point:
        """Mean velocity (m/s) during the last tick."""
        (x0, y0, _), (x1, y1, _) = self.poses[-2:] if len(self.poses) > 1 else self.poses * 2
        dt = self.tick_ns * NANO
        return ((x1 - x0) / dt, (y1 - y0) / dt)

    def centers(self) -> list[Point]:
        """The scenario's obstacles, then the other robots, in near()'s order."""
        return [*super().centers(), *(place.pose.position for place in self.others)]


class Fleet:
    """All robots of a scenario, one tick for all; who has ended stands where it is."""

    def __init__(
        self, scenario: Scenario, tick_ns: int, goal_tolerance_m: float, seed: int = 0
    ) -> None:
        """Put every robot at its start. ConfigError for a scenario that names no robots."""
        if not scenario.robots:
            raise ConfigError(f"scenario {scenario.name!r}: names no robots; add robots to it")
        self.scenario, self.tick_ns, self.seed = scenario, tick_ns, seed
        self.tick = 0
        count = len(scenario.robots)
        self.robot_worlds = [RobotWorld(self, number, goal_tolerance_m) for number in range(count)]
        self.outcomes: list[Outcome | None] = [place.outcome() for place in self.robot_worlds]

    @property
    def running(self) -> list[int]:
        """Who has not ended yet, as numbers from 0."""
        return [number for number, outcome in enumerate(self.outcomes) if outcome is None]

    @property
    def distance_to_goal_m(self) -> float:
        """How far the farthest robot is from its goal."""
        return max(place.distance_to_goal_m for place in self.robot_worlds)

    def step(self, told: dict[int, Point]) -> None:
        """Move everybody who is under way and time on by one tick; told as for World.step()."""
        going = self.running
        for number, place in enumerate(self.robot_worlds):
            if number in going:
                place.step(told[number])
            else:
                place.tick += 1  # the obstacles around it go on
            place.poses.append(place.pose)
        self.tick += 1
        for number in going:
            self.outcomes[number] = self.robot_worlds[number].outcome()


def scenarios_with_others(
    scenario: Scenario, poses: Sequence[Sequence[Pose2D]], tick_ns: int
) -> list[Scenario]:
    """The scenario of each robot with all others as obstacles that went as they did.

    poses holds those of each robot, one per tick until it ended.
    """
    ways = [way(went, tick_ns, scenario.robot_radius_m) for went in poses]
    found = []
    for number in range(len(ways)):
        own, others = alone(scenario, number), ways[:number] + ways[number + 1 :]
        found.append(replace(own, obstacles=(*own.obstacles, *others)))
    return found


def way(poses: Sequence[Pose2D], tick_ns: int, radius_m: float) -> Obstacle:
    """A robot that was at these poses, one per tick, as an obstacle that moves and turns.

    Between two ticks it is uniform, as for all metrics; ticks that lie on one straight way at
    one speed are one stretch.
    """
    dt = tick_ns * NANO
    stretches: list[tuple[int, float, float]] = []  # first tick, speed, heading
    (x, y), first = poses[0].position, 0
    vx = vy = 0.0
    for tick, (a, b) in enumerate(pairwise(poses)):
        ahead_s = (tick + 1 - first) * dt
        on_s = (tick - first) * dt
        if stretches and distance((x + vx * ahead_s, y + vy * ahead_s), b.position) <= DRIFT_M:
            continue
        x, y, first = x + vx * on_s, y + vy * on_s, tick
        speed, heading = distance((x, y), b.position) / dt, bearing((x, y), b.position)
        if distance(a.position, b.position) <= DRIFT_M:
            speed = heading = 0.0
        vx, vy = towards((0.0, 0.0), heading, speed)
        stretches.append((tick, speed, heading))
    (_, speed, heading), *turns = stretches or [(0, 0.0, 0.0)]
    if len(poses) > 1 and stretches[-1][1] > 0.0:
        turns.append((len(poses) - 1, 0.0, 0.0))  # what came later nobody knows
    return Obstacle(
        center_m=poses[0].position,
        radius_m=radius_m,
        speed_mps=speed,
        heading_rad=heading,
        turns=tuple(
            Turn(at_s=tick * tick_ns * NANO, speed_mps=speed, heading_rad=heading)
            for tick, speed, heading in turns
        ),
    )


def run_fleet(
    scenario: Scenario,
    *,
    planner: PlannerParams | None = None,
    sensor: SensorParams | None = None,
    seed: int = 0,
    go_on: Callable[[Fleet], bool] = lambda _: True,
    path_planner: MakePlanner | None = None,
    observe: Observe = observe_sectors,
) -> tuple[Episode, ...]:
    """run_episode.run for every robot of a scenario at once: an Episode each, in its order.

    brain makes the planner of a robot from its seed. The obstacles of an episode's scenario are
    the scenario's own, then the other robots as they went.
    """
    planner, sensor = planner or PlannerParams(), sensor or SensorParams()
    make = path_planner or (lambda seed: supervised_algorithm_1(planner, seed))
    fleet = Fleet(scenario, planner.tick_ns, planner.goal_tolerance_m, seed)
    path_planners = [make(place.seed) for place in fleet.robot_worlds]
    ticks: list[list[Decision]] = [[] for _ in path_planners]

    def decide(numbers: Sequence[int]) -> dict[int, Point]:
        for number in numbers:
            ticks[number].append(
                path_planners[number].plan(observe(fleet.robot_worlds[number], sensor))
            )
        return {n: command(ticks[n][-1], scenario.robot, planner.tick_ns) for n in numbers}

    told = decide(range(len(path_planners)))
    while (going := fleet.running) and go_on(fleet):
        fleet.step(told)
        told = decide(going)
    return episodes(fleet, ticks, planner, sensor, "core")


def episodes(
    fleet: Fleet,
    ticks: Sequence[Sequence[Decision]],
    planner: PlannerParams,
    sensor: SensorParams,
    driver: str,
) -> tuple[Episode, ...]:
    """What came of a fleet: an Episode of each robot."""
    errs = fleet.scenario.robot.noise.of_odometry
    worlds = scenarios_with_others(
        fleet.scenario, [place.poses for place in fleet.robot_worlds], fleet.tick_ns
    )
    return tuple(
        Episode(
            scenario=worlds[number],
            sensor=sensor,
            planner=planner,
            seed=place.seed,
            driver=driver,
            ticks=tuple(ticks[number]),
            outcome=fleet.outcomes[number] or Outcome.INTERRUPTED,
            truth=tuple(place.poses[: len(ticks[number])]) if errs else (),
        )
        for number, place in enumerate(fleet.robot_worlds)
    )
