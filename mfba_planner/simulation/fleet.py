# SPDX-License-Identifier: Apache-2.0
"""Fleet: several robots in one world, each a moving circle to the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise, zip_longest

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import Point, Pose2D, bearing, distance, towards
from ..core.planner_types import NANO, Decision, PathPlanner
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..planning.supervised_planner import supervised_algorithm_1
from .episode import Episode, Outcome
from .nearby_obstacles import Nearby
from .obstacle_motion import Obstacle, Turn
from .planner_observations import Observe, observe_sectors
from .scenario import Scenario
from .triggers import after_triggers, before_triggers
from .world import World

FLEET_STREAM = 6  # spawn key of the robots' SeedSequence children; one number per purpose
DRIFT_M = 1e-12  # by which a path of straight stretches may miss a pose

MakePlanner = Callable[[int], PathPlanner]  # from a robot's seed


def robot_seed(seed: int, number: int) -> int:
    """Seed of one robot of a fleet (number from 0), for its planner and its sensors."""
    child = np.random.SeedSequence(seed, spawn_key=(FLEET_STREAM, number))
    return int(child.generate_state(1, np.uint64)[0] >> np.uint64(1))


def single_robot_scenario(scenario: Scenario, number: int) -> Scenario:
    """The scenario of one robot of a fleet (number from 0), without the other robots."""
    member = scenario.robots[number]
    return replace(
        scenario,
        name=f"{scenario.name}.{member.name}"[:100],
        start_m=member.start_m,
        goal_m=member.goal_m,
        robots=(),
    )


class RobotWorld(World):
    """The world of one robot of a fleet: the scenario's obstacles, then the other robots."""

    def __init__(self, fleet: Fleet, number: int, tolerance_m: float) -> None:
        """Put the robot at its start, at tick 0."""
        seed = robot_seed(fleet.seed, number)
        super().__init__(
            single_robot_scenario(fleet.scenario, number), fleet.tick_ns, tolerance_m, seed
        )
        self.name = fleet.scenario.robots[number].name
        self.poses = [self.pose]  # one per tick of the fleet
        self.seed = seed
        self._fleet, self._number = fleet, number
        self._own = len(self.scenario.obstacles)

    def _check_triggers(self) -> None:
        """The Fleet does: any of its robots may reach a trigger."""

    @property
    def others(self) -> list[RobotWorld]:
        """The worlds of the other robots, in scenario order."""
        return [p for p in self._fleet.robot_worlds if p is not self]

    def near(self, reach_m: float, position: Point | None = None) -> Nearby:
        """As World.near(); includes all other robots."""
        names, circles = super().near(reach_m, position)
        enlarged_m = 2.0 * self.scenario.robot_radius_m
        others = [(robot_world.pose.position, enlarged_m) for robot_world in self.others]
        return [*names, *range(self._own, self._own + len(others))], [*circles, *others]

    def radius_m(self, index: int) -> float:
        """As World.radius_m()."""
        if index < self._own:
            return super().radius_m(index)
        return self.scenario.robot_radius_m

    def velocity(self, index: int) -> Point:
        """As World.velocity(); a robot's is that of its last tick, as the next is not decided."""
        if index < self._own:
            return super().velocity(index)
        return self.others[index - self._own].last_velocity

    @property
    def last_velocity(self) -> Point:
        """Mean velocity (m/s) during the last tick."""
        (x0, y0, _), (x1, y1, _) = self.poses[-2:] if len(self.poses) > 1 else self.poses * 2
        dt = self.tick_ns * NANO
        return ((x1 - x0) / dt, (y1 - y0) / dt)

    def centers(self) -> list[Point]:
        """Centres of the scenario's obstacles, then of the other robots, as near() counts them."""
        return [*super().centers(), *(robot_world.pose.position for robot_world in self.others)]


class Fleet:
    """All robots of a scenario at one tick; a robot whose run has ended stands still."""

    def __init__(
        self, scenario: Scenario, tick_ns: int, goal_tolerance_m: float, seed: int = 0
    ) -> None:
        """Put every robot at its start. Raises ConfigError for a scenario without robots."""
        if not scenario.robots:
            raise ConfigError(f"scenario {scenario.name!r}: names no robots; add robots to it")
        self.scenario, self.tick_ns, self.seed = before_triggers(scenario), tick_ns, seed
        self.tick = 0
        count = len(scenario.robots)
        self.robot_worlds = [RobotWorld(self, number, goal_tolerance_m) for number in range(count)]
        self.outcomes: list[Outcome | None] = [
            robot_world.outcome() for robot_world in self.robot_worlds
        ]
        self._check_triggers()

    def _check_triggers(self) -> None:
        positions = [robot_world.pose.position for robot_world in self.robot_worlds]
        for robot_world in self.robot_worlds:
            robot_world.start_triggered(positions)

    @property
    def running(self) -> list[int]:
        """Numbers (from 0) of the robots whose run has not ended."""
        return [number for number, outcome in enumerate(self.outcomes) if outcome is None]

    @property
    def distance_to_goal_m(self) -> float:
        """Largest distance of a robot to its goal."""
        return max(robot_world.distance_to_goal_m for robot_world in self.robot_worlds)

    def step(self, commands: dict[int, Point]) -> None:
        """Advance by one tick: move each running robot by its command, as World.step()."""
        running = self.running
        for number, robot_world in enumerate(self.robot_worlds):
            if number in running:
                robot_world.step(commands[number])
            else:
                robot_world.tick += 1  # its obstacles keep moving
            robot_world.poses.append(robot_world.pose)
        self.tick += 1
        self._check_triggers()
        for number in running:
            self.outcomes[number] = self.robot_worlds[number].outcome()


def scenarios_with_others(
    scenario: Scenario, poses: Sequence[Sequence[Pose2D]], tick_ns: int
) -> list[Scenario]:
    """The scenario of each robot, with the other robots as obstacles that move along their poses.

    poses holds the poses of each robot, one per tick until its run ended. Triggers are those
    that any robot reached.
    """
    ticks = zip_longest(*poses)  # a robot whose run has ended reaches nothing new
    scenario = after_triggers(
        scenario,
        (
            (tick * tick_ns * NANO, [pose.position for pose in some if pose is not None])
            for tick, some in enumerate(ticks)
        ),
    )
    paths = [path_as_obstacle(path, tick_ns, scenario.robot_radius_m) for path in poses]
    found = []
    for number in range(len(paths)):
        own, others = single_robot_scenario(scenario, number), paths[:number] + paths[number + 1 :]
        found.append(replace(own, obstacles=(*own.obstacles, *others)))
    return found


def path_as_obstacle(poses: Sequence[Pose2D], tick_ns: int, radius_m: float) -> Obstacle:
    """A robot's path (one pose per tick) as an obstacle that moves and turns.

    Motion is uniform between two ticks, as for all metrics; ticks on one straight line at one
    speed are one stretch.
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
        turns.append((len(poses) - 1, 0.0, 0.0))  # its later motion is unknown
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
    """run_episode.run for all robots of a scenario at once: an Episode each, in scenario order.

    path_planner makes the planner of a robot from its seed. The obstacles of an episode's
    scenario are the original ones, then the other robots along their paths.
    """
    planner, sensor = planner or PlannerParams(), sensor or SensorParams()
    make = path_planner or (lambda seed: supervised_algorithm_1(planner, seed))
    fleet = Fleet(scenario, planner.tick_ns, planner.goal_tolerance_m, seed)
    path_planners = [make(robot_world.seed) for robot_world in fleet.robot_worlds]
    ticks: list[list[Decision]] = [[] for _ in path_planners]

    def decide(numbers: Sequence[int]) -> dict[int, Point]:
        for number in numbers:
            ticks[number].append(
                path_planners[number].plan(observe(fleet.robot_worlds[number], sensor))
            )
        return {n: fleet.robot_worlds[n].command(ticks[n][-1]) for n in numbers}

    commands = decide(range(len(path_planners)))
    while (running := fleet.running) and go_on(fleet):
        fleet.step(commands)
        commands = decide(running)
    return episodes(fleet, ticks, planner, sensor, "core")


def episodes(
    fleet: Fleet,
    ticks: Sequence[Sequence[Decision]],
    planner: PlannerParams,
    sensor: SensorParams,
    driver: str,
) -> tuple[Episode, ...]:
    """The Episode of each robot of a fleet."""
    errs = fleet.scenario.robot.noise.affects_odometry
    worlds = scenarios_with_others(
        fleet.scenario, [robot_world.poses for robot_world in fleet.robot_worlds], fleet.tick_ns
    )
    return tuple(
        Episode(
            scenario=worlds[number],
            sensor=sensor,
            planner=planner,
            seed=robot_world.seed,
            driver=driver,
            ticks=tuple(ticks[number]),
            outcome=fleet.outcomes[number] or Outcome.INTERRUPTED,
            truth=tuple(robot_world.poses[: len(ticks[number])]) if errs else (),
        )
        for number, robot_world in enumerate(fleet.robot_worlds)
    )
