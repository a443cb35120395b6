# SPDX-License-Identifier: Apache-2.0
"""The core driver: run one episode from start to end, without ROS."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import fields
from typing import TypeVar

from ..core.errors import ConfigError
from ..core.planner_types import Observation, PathPlanner
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import make_planner
from ..planning.planner_params import PlannerParams
from ..planning.supervised_planner import supervised_algorithm_1
from .episode import Episode, Outcome
from .fleet import Fleet, run_fleet
from .planner_observations import Observe, observe_scan, observe_sectors
from .scenario import Scenario
from .scenario_map import with_known_map
from .triggers import before_triggers
from .world import World

T = TypeVar("T")
GoOn = Callable[[World], bool]


def always_continue(_: World) -> bool:
    """The default of go_on: never stop a run early."""
    return True


def episode_generator(
    scenario: Scenario,
    planner: PlannerParams,
    sensor: SensorParams,
    seed: int,
    go_on: GoOn,
    path_planner: PathPlanner,
    observe: Observe,
) -> Generator[Observation, None, Episode]:
    """run() as a generator: yields the observation before every decision."""
    _check_robot(scenario, planner)
    world = World(scenario, planner.tick_ns, planner.goal_tolerance_m, seed)
    obs = observe(world, sensor)
    yield obs
    ticks, truth = [path_planner.plan(obs)], [world.pose]
    while (outcome := world.outcome()) is None and go_on(world):
        world.step(world.command(ticks[-1]))
        obs = observe(world, sensor)
        yield obs
        ticks.append(path_planner.plan(obs))
        truth.append(world.pose)
    return Episode(
        scenario=before_triggers(scenario),  # which may be that of another run
        sensor=sensor,
        planner=planner,
        seed=seed,
        driver="core",
        ticks=tuple(ticks),
        outcome=outcome or Outcome.INTERRUPTED,
        truth=tuple(truth) if scenario.robot.noise.affects_odometry else (),
    )


def _check_robot(scenario: Scenario, planner: PlannerParams) -> None:
    """Raise ConfigError for a planner that decides for another robot than the scenario's."""
    own = scenario.planner_params(planner)
    if own == planner:
        return
    for name in (item.name for item in fields(planner)):
        if (given := getattr(planner, name)) != (value := getattr(own, name)):
            raise ConfigError(
                f"planner.{name} {given}: the scenario's robot has {value}; "
                "take the options from Scenario.planner_params()"
            )


def run(
    scenario: Scenario,
    *,
    planner: PlannerParams | None = None,
    sensor: SensorParams | None = None,
    seed: int = 0,
    go_on: GoOn = always_continue,
    path_planner: PathPlanner | None = None,
    observe: Observe = observe_sectors,
) -> Episode:
    """The core driver: Algorithm 1 from start to goal or time limit, without ROS.

    go_on is called with the world after every decision; False ends the run. path_planner
    replaces Algorithm 1 but keeps speed, step length and tolerance of `planner`, which must then
    be for the scenario's robot (Scenario.planner_params; else ConfigError); observe makes its
    observations.
    """
    planner = planner or PlannerParams()
    if path_planner is None:
        planner = scenario.planner_params(planner)
        path_planner = supervised_algorithm_1(planner, seed)
    return run_to_end(
        episode_generator(
            scenario, planner, sensor or SensorParams(), seed, go_on, path_planner, observe
        )
    )


def run_to_end(generator: Generator[object, None, T]) -> T:
    """Exhaust a generator and return its result."""
    while True:
        try:
            next(generator)
        except StopIteration as end:
            result: T = end.value
            return result


def simulate(
    scenario: Scenario,
    *,
    planner: PlannerParams,
    sensor: SensorParams,
    seed: int,
    go_on: Callable[[World], bool] = lambda _: True,
) -> Episode:
    """simulation.run_episode.run with the planner of planner.method."""
    params = scenario.planner_params(planner)
    return run(
        scenario,
        planner=params,
        sensor=sensor,
        seed=seed,
        go_on=go_on,
        path_planner=with_known_map(make_planner(params, sensor, seed), params, scenario),
        observe=observe_scan if params.reads_scan else observe_sectors,
    )


def simulate_fleet(
    scenario: Scenario,
    *,
    planner: PlannerParams,
    sensor: SensorParams,
    seed: int,
    go_on: Callable[[Fleet], bool] = lambda _: True,
) -> tuple[Episode, ...]:
    """simulation.fleet.run_fleet with a planner of planner.method for every robot."""
    params = scenario.planner_params(planner)
    return run_fleet(
        scenario,
        planner=params,
        sensor=sensor,
        seed=seed,
        go_on=go_on,
        path_planner=lambda child: with_known_map(
            make_planner(params, sensor, child), params, scenario
        ),
        observe=observe_scan if params.reads_scan else observe_sectors,
    )
