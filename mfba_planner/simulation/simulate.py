# SPDX-License-Identifier: Apache-2.0
"""Simulate an episode, of one robot or a fleet, with the planner its parameters name; no ROS."""

from __future__ import annotations

from collections.abc import Callable

from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import make_planner
from ..planning.planner_params import PlannerParams
from .episode import Episode
from .fleet import Fleet, run_fleet
from .planner_observations import observe_scan, observe_sectors
from .run_episode import run
from .scenario import Scenario
from .world import World


def simulate(
    scenario: Scenario,
    *,
    planner: PlannerParams,
    sensor: SensorParams,
    seed: int,
    go_on: Callable[[World], bool] = lambda _: True,
) -> Episode:
    """simulation.run_episode.run with the planner of planner.method."""
    return run(
        scenario,
        planner=planner,
        sensor=sensor,
        seed=seed,
        go_on=go_on,
        path_planner=make_planner(planner, sensor, seed),
        observe=observe_scan if planner.tracks_scan else observe_sectors,
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
    return run_fleet(
        scenario,
        planner=planner,
        sensor=sensor,
        seed=seed,
        go_on=go_on,
        path_planner=lambda child: make_planner(planner, sensor, child),
        observe=observe_scan if planner.tracks_scan else observe_sectors,
    )
