# SPDX-License-Identifier: Apache-2.0
"""The one currency: a run as scenario, parameters, seed and ticks; and the core driver."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TypeVar

from ..core.errors import ConfigError, InputError
from ..core.geometry import Point, Pose2D, distance
from ..perception.sensory_vector import (
    Ranges,
    SensorParams,
    aligned,
    blind,
    sense_circles,
    sense_scan,
)
from ..planning.algorithm_1 import (
    NANO,
    Decision,
    Observation,
    PathPlanner,
    PlannerParams,
    Refused,
    observe,
)
from ..planning.supervised_planner import algorithm_1
from .batched_motion import Motion
from .differential_drive import Speeds, command, obey
from .nearby_obstacles import Found, Nearby
from .scenario import Scenario, velocity_at
from .sensor_noise import Instruments, Reading

T = TypeVar("T")
DOUBTS = 4.0  # deviations of odometry by which the goal may be missed


class Outcome(Enum):
    """How a run ended."""

    GOAL_REACHED = "goal_reached"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """A run, whatever drove it: one Decision per tick, the first at tick 0."""

    scenario: Scenario
    sensor: SensorParams = field(default_factory=SensorParams)
    planner: PlannerParams = field(default_factory=PlannerParams)
    seed: int
    driver: str
    ticks: tuple[Decision, ...]
    outcome: Outcome
    truth: tuple[Pose2D, ...] = ()  # where the robot was at each tick; (): where it saw itself
    brain: str = ""  # who decided, where that is not what planner's own options name

    @property
    def label(self) -> str:
        """Who decided, for people."""
        return self.brain or self.planner.label

    def time_s(self, stamp_ns: int) -> float:
        """Time since the first tick in seconds, the t of the obstacles' motion."""
        return (stamp_ns - self.planner.tick_ns) * NANO


def stamp_of(tick: int, tick_ns: int) -> int:
    """Stamp of tick k = 0, 1, ...: (k + 1) tick_ns, since ROS reads a stamp of 0 as unset."""
    return (tick + 1) * tick_ns


def advance(pose: Pose2D, velocity: Point, tick_ns: int) -> Pose2D:
    """The omnidirectional robot after one tick at constant velocity (m/s); yaw is kept."""
    dt = tick_ns * NANO
    return Pose2D(pose.x + velocity[0] * dt, pose.y + velocity[1] * dt, pose.yaw)


class World:
    """The simulated world between two ticks: all that world_sim knows, without ROS."""

    def __init__(
        self, scenario: Scenario, tick_ns: int, goal_tolerance_m: float, seed: int = 0
    ) -> None:
        """Put the robot at the start, at tick 0; the seed is its instruments'.

        Raises ConfigError for a scenario of several robots.
        """
        if scenario.robots:
            raise ConfigError(
                f"scenario {scenario.name!r}: names {len(scenario.robots)} robots, which share a "
                "world; use simulation.fleet"
            )
        self.scenario = scenario
        self.tick_ns = tick_ns
        self.goal_tolerance_m = goal_tolerance_m
        self.tick = 0
        self.pose = Pose2D(*scenario.start_m)
        self.speeds = Speeds()  # of a differential drive
        self._instruments = Instruments(scenario.robot, scenario.walls, tick_ns, seed)
        self._read: tuple[int, Reading] | None = None
        self._nearby = Nearby(Motion(scenario), tick_ns)

    def near(self, reach_m: float, position: Point | None = None) -> Found:
        """Indices, and (centre, enlarged radius), of whoever may be within reach of its edge now.

        In the scenario's order; nobody who is within reach is missing.
        """
        return self._nearby.at(self.tick, position or self.pose.position, reach_m)

    def centers(self) -> list[Point]:
        """Centres of all that is around, now: the scenario's obstacles in its order."""
        return self.scenario.centers(self.time_s)

    @property
    def left_m(self) -> float:
        """How far the goal is."""
        return distance(self.pose.position, self.scenario.goal_m)

    def radius_m(self, index: int) -> float:
        """Radius of whoever near() calls by that index, not enlarged."""
        return self.scenario.obstacles[index].radius_m

    def velocity(self, index: int) -> Point:
        """(vx, vy) in m/s, now, of whoever near() calls by that index."""
        return velocity_at(self.scenario.obstacles[index], self.time_s, self.scenario.walls)

    @property
    def stamp_ns(self) -> int:
        """Stamp of the present tick."""
        return stamp_of(self.tick, self.tick_ns)

    @property
    def time_s(self) -> float:
        """Time of the obstacles' motion, 0 at tick 0."""
        return self.tick * self.tick_ns * NANO

    def outcome(self) -> Outcome | None:
        """How the run has ended by the present tick, None while it goes on."""
        # Who sees itself there need not be: the robot stops where its odometry says so.
        doubt_m = DOUBTS * self.scenario.robot.noise.odom_m
        if self.left_m <= self.goal_tolerance_m + doubt_m:
            return Outcome.GOAL_REACHED
        if self.time_s >= self.scenario.time_limit_s:
            return Outcome.TIME_LIMIT
        return None

    def step(self, told: Point) -> None:
        """Move robot and time on by one tick; told is what differential_drive.command gives."""
        robot = self.scenario.robot
        if robot.turns:
            self.pose, self.speeds = obey(self.pose, self.speeds, told, robot, self.tick_ns)
        else:
            self.pose = advance(self.pose, told, self.tick_ns)
        before_s = self.time_s
        self.tick += 1
        for kidnapping in self.scenario.kidnappings:
            if before_s < kidnapping.at_s <= self.time_s:
                self.put(Pose2D(*kidnapping.to_m, self.pose.yaw))

    def put(self, pose: Pose2D) -> None:
        """Put the robot somewhere else, at rest."""
        self.pose, self.speeds, self._read = pose, Speeds(), None

    def read(self) -> Reading:
        """What the robot's instruments say at the present tick: the same however often."""
        robot = self.scenario.robot
        if not (robot.lidar.beams or robot.noise.of_odometry):
            return Reading(self.pose, None)
        if self._read is None or self._read[0] != self.tick:
            surfaces: list[tuple[float, float, float]] = []
            if robot.lidar.beams:
                surfaces = [
                    (*center, self.radius_m(index))
                    for index, (center, _) in zip(*self.near(robot.lidar.range_max_m))
                ]
            self._read = self.tick, self._instruments.read(self.stamp_ns, self.pose, surfaces)
        return self._read[1]


def sense(world: World, params: SensorParams) -> Ranges:
    """What the ring of virtual sensors measures at the present tick, of circles or of a scan.

    Raises InputError for a scan that cannot be used.
    """
    return _sensed(world, world.read(), params)


def _sensed(world: World, seen: Reading, params: SensorParams) -> Ranges:
    if seen.scan is None:
        position = seen.received.position
        _, circles = world.near(params.sensing_range_m, position)
        return sense_circles(position, circles, params)
    yaw = seen.received.yaw + world.scenario.robot.lidar.yaw_rad
    return sense_scan(seen.scan, yaw, world.scenario.robot_radius_m, params)


def look(world: World, sensor: SensorParams) -> Observation:
    """What the paper's planner gets to know at the present tick: pose, sectors, goal."""
    seen = world.read()
    ranges: Ranges | Refused
    try:
        ranges = _sensed(world, seen, sensor)
    except InputError:
        ranges = blind(1, math.nan)  # the sensor says so by sectors of NaN
    pose = seen.received
    return observe(world.stamp_ns, pose, ranges, world.scenario.goal_m, pose)


def look_at_scan(world: World, sensor: SensorParams) -> Observation:
    """look(), and the scan itself, in a frame aligned with odom."""
    obs, scan = look(world, sensor), world.read().scan
    if scan is None or obs.refused:
        return obs
    yaw = obs.pose.yaw + world.scenario.robot.lidar.yaw_rad
    return replace(obs, scan=aligned(scan, yaw))


Look = Callable[[World, SensorParams], Observation]
GoOn = Callable[[World], bool]


def to_the_end(_: World) -> bool:
    """Go on, whatever the world is like."""
    return True


def course(
    scenario: Scenario,
    planner: PlannerParams,
    sensor: SensorParams,
    seed: int,
    go_on: GoOn,
    brain: PathPlanner,
    look: Look,
) -> Generator[Observation, None, Episode]:
    """run(), pausing before every decision: yields what is about to be decided upon."""
    world = World(scenario, planner.tick_ns, planner.goal_tolerance_m, seed)
    obs = look(world, sensor)
    yield obs
    ticks, truth = [brain.plan(obs)], [world.pose]
    while (outcome := world.outcome()) is None and go_on(world):
        world.step(command(ticks[-1], scenario.robot, world.tick_ns))
        obs = look(world, sensor)
        yield obs
        ticks.append(brain.plan(obs))
        truth.append(world.pose)
    return Episode(
        scenario=scenario,
        sensor=sensor,
        planner=planner,
        seed=seed,
        driver="core",
        ticks=tuple(ticks),
        outcome=outcome or Outcome.INTERRUPTED,
        truth=tuple(truth) if scenario.robot.noise.of_odometry else (),
    )


def run(
    scenario: Scenario,
    *,
    planner: PlannerParams | None = None,
    sensor: SensorParams | None = None,
    seed: int = 0,
    go_on: GoOn = to_the_end,
    brain: PathPlanner | None = None,
    look: Look = look,
) -> Episode:
    """The core driver: Algorithm 1 from start to goal or time limit, without ROS.

    go_on sees the world after every decision and ends the run by returning False. brain takes
    the decisions instead of Algorithm 1, with planner's speed, step and tolerance; look is what
    it gets to know.
    """
    planner = planner or PlannerParams()
    brain = brain or algorithm_1(planner, seed)
    return ended(course(scenario, planner, sensor or SensorParams(), seed, go_on, brain, look))


def ended(under_way: Generator[object, None, T]) -> T:
    """Go on to the end, and return what comes of it."""
    while True:
        try:
            next(under_way)
        except StopIteration as end:
            result: T = end.value
            return result
