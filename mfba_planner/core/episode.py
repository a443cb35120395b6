# SPDX-License-Identifier: Apache-2.0
"""The one currency: a run as scenario, parameters, seed and ticks; and the core driver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from .errors import ConfigError
from .geometry import Point, Pose2D, distance
from .guarded import Guarded
from .motion import Motion
from .nearby import Found, Nearby
from .planner import NANO, Decision, Method, Observation, PathPlanner, Planner, PlannerParams
from .sensing import Ranges, SensorParams, sense_circles
from .world import Scenario


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

    def __init__(self, scenario: Scenario, tick_ns: int, goal_tolerance_m: float) -> None:
        """Put the robot at the start, at tick 0."""
        self.scenario = scenario
        self.tick_ns = tick_ns
        self.goal_tolerance_m = goal_tolerance_m
        self.tick = 0
        self.pose = Pose2D(*scenario.start_m)
        self._nearby = Nearby(Motion(scenario), tick_ns)

    def near(self, reach_m: float) -> Found:
        """Indices, and (centre, enlarged radius), of whoever may be within reach of its edge now.

        In the scenario's order; nobody who is within reach is missing.
        """
        return self._nearby.at(self.tick, self.pose.position, reach_m)

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
        if distance(self.pose.position, self.scenario.goal_m) <= self.goal_tolerance_m:
            return Outcome.GOAL_REACHED
        if self.time_s >= self.scenario.time_limit_s:
            return Outcome.TIME_LIMIT
        return None

    def step(self, velocity: Point) -> None:
        """Move robot and time on by one tick."""
        self.pose = advance(self.pose, velocity, self.tick_ns)
        self.tick += 1


def sense(world: World, params: SensorParams) -> Ranges:
    """What the ring of virtual sensors measures at the present tick."""
    _, circles = world.near(params.sensing_range_m)
    return sense_circles(world.pose.position, circles, params)


def look(world: World, sensor: SensorParams) -> Observation:
    """What the paper's planner gets to know at the present tick: pose, sectors, goal."""
    stamp_ns = world.stamp_ns
    return Observation(
        stamp_ns=stamp_ns,
        pose=world.pose,
        ranges_m=sense(world, sensor),
        goal=world.scenario.goal_m,
        now_ns=stamp_ns,
    )


Look = Callable[[World, SensorParams], Observation]


def run(
    scenario: Scenario,
    *,
    planner: PlannerParams | None = None,
    sensor: SensorParams | None = None,
    seed: int = 0,
    go_on: Callable[[World], bool] = lambda _: True,
    brain: PathPlanner | None = None,
    look: Look = look,
) -> Episode:
    """The core driver: Algorithm 1 from start to goal or time limit, without ROS.

    go_on sees the world after every decision and ends the run by returning False. brain takes
    the decisions instead of Algorithm 1, with planner's speed, step and tolerance; look is what
    it gets to know.
    """
    planner = planner or PlannerParams()
    sensor = sensor or SensorParams()
    world = World(scenario, planner.tick_ns, planner.goal_tolerance_m)
    if brain is None:
        if planner.method is not Method.PAPER:
            raise ConfigError(
                f"method={planner.method.value}: not the core's own; use planners.method.simulate"
            )
        brain = Guarded(Planner(planner, seed))
    ticks = [brain.plan(look(world, sensor))]
    while (outcome := world.outcome()) is None and go_on(world):
        world.step(ticks[-1].velocity)
        ticks.append(brain.plan(look(world, sensor)))
    return Episode(
        scenario=scenario,
        sensor=sensor,
        planner=planner,
        seed=seed,
        driver="core",
        ticks=tuple(ticks),
        outcome=outcome or Outcome.INTERRUPTED,
    )
