# SPDX-License-Identifier: Apache-2.0
"""Robots that swap places across a circle: how many seeds go without a contact, by planner.

Run: python bench/fleet.py. A seed turns every robot's start on the circle by up to JITTER_DEG,
its goal opposite, and names all random streams. A seed succeeds when every robot is at its goal
and none has touched another; contacts are judged continuously in time.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.statistics import share_interval
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.peers.orca import Orca
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import Predictive, PredictiveParams, preset
from mfba_planner.planning.trajectory_cost import RiskParams
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.fleet import MakePlanner, run_fleet
from mfba_planner.simulation.planner_observations import (
    Observe,
    Perception,
    observe_scan,
    observe_sectors,
)
from mfba_planner.simulation.robot_model import DEFAULT_BEAMS, Lidar, Robot
from mfba_planner.simulation.scenario import FleetRobot, Scenario

JITTER_DEG = 8.0  # of 36 between two robots
JITTER_STREAM = 7  # spawn key of the starts' SeedSequence children


def circle(robots: int, radius_m: float, seed: int, robot: Robot) -> Scenario:
    """Robots on a circle, each with its goal opposite."""
    sequence = np.random.SeedSequence(seed, spawn_key=(JITTER_STREAM,))
    jitter = np.random.Generator(np.random.PCG64(sequence)).uniform(-1.0, 1.0, robots)
    members = []
    for k, turn in enumerate(jitter.tolist()):
        angle = 2.0 * math.pi * k / robots + math.radians(JITTER_DEG) * turn
        x, y = radius_m * math.cos(angle), radius_m * math.sin(angle)
        members.append(FleetRobot(name=f"robot{k}", start_m=(x, y), goal_m=(-x, -y)))
    return Scenario(
        name="swap",
        start_m=members[0].start_m,
        goal_m=members[0].goal_m,
        robots=tuple(members),
        robot=robot,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Configuration:
    """A planner, its robot and its sensing."""

    planner: PlannerParams
    sensor: SensorParams = SensorParams()
    robot: Robot = Robot()
    make: Callable[[PlannerParams, SensorParams], MakePlanner]
    observe: Callable[[], Observe] = lambda: observe_sectors


def _paper(params: PlannerParams, _: SensorParams) -> MakePlanner:
    return lambda seed: Algorithm1(params, seed)


def _predictive(params: PlannerParams, sensor: SensorParams) -> MakePlanner:
    return lambda seed: Predictive(params, sensor, seed)


def _as_run(params: PlannerParams, sensor: SensorParams) -> MakePlanner:
    return lambda seed: make_planner(params, sensor, seed)


def _wide(params: PlannerParams, sensor: SensorParams) -> MakePlanner:
    return lambda seed: Predictive(params, sensor, seed, WIDE)


def _orca(params: PlannerParams, sensor: SensorParams) -> MakePlanner:
    return lambda seed: Orca(params, sensor, seed)


# Robots of a fleet do not keep their velocities: pass them at 0.2 m rather than at 0.015 m.
WIDE = PredictiveParams(risk=RiskParams(margin_m=0.2, close_m=3.0))
FAR = SensorParams(sensing_range_m=3.0)
LIDAR = Robot(lidar=Lidar(beams=DEFAULT_BEAMS))


def _known() -> Observe:
    return Perception("known", sectors=False)


CONFIGURATIONS: dict[str, Configuration] = {
    "predictive, lidar (mfba sim swap)": Configuration(
        planner=preset(PlannerParams(method=Method.PREDICTIVE)),
        robot=LIDAR,
        make=_as_run,
        observe=lambda: observe_scan,
    ),
    "paper, sectors": Configuration(planner=PlannerParams(), make=_paper),
    "paper, sectors, step 0.08 m": Configuration(
        planner=replace(PlannerParams(), step_length_m=0.08), make=_paper
    ),
    "predictive, sectors": Configuration(planner=preset(), make=_predictive),
    "predictive, known within 0.8 m": Configuration(
        planner=preset(), make=_predictive, observe=_known
    ),
    "predictive, known within 3 m": Configuration(
        planner=preset(), sensor=FAR, make=_predictive, observe=_known
    ),
    "predictive, known, wide berth": Configuration(planner=preset(), make=_wide, observe=_known),
    "orca, known within 3 m": Configuration(
        planner=preset(), sensor=FAR, make=_orca, observe=_known
    ),
}


def measure(
    name: str, configuration: Configuration, robots: int, radius_m: float, seeds: range
) -> None:
    """One line of the table."""
    good = arrived = contacts = 0
    clearance_m, lasts_s, began = math.inf, 0.0, time.perf_counter()
    for seed in seeds:
        done = run_fleet(
            circle(robots, radius_m, seed, configuration.robot),
            planner=configuration.planner,
            sensor=configuration.sensor,
            seed=seed,
            path_planner=configuration.make(configuration.planner, configuration.sensor),
            observe=_per_robot(configuration.observe),
        )
        results = [evaluate(episode) for episode in done]
        at_goal = sum(result.outcome is Outcome.GOAL_REACHED for result in results)
        hits = sum(result.collisions for result in results)
        good += at_goal == robots and not hits
        arrived += at_goal
        contacts += hits
        clearance_m = min(clearance_m, *(result.min_clearance_m for result in results))
        lasts_s += max(result.time_s for result in results)
    low, high = share_interval(good, len(seeds))
    print(
        f"{name:<34} {good:>4} of {len(seeds)}  [{100 * low:5.1f}, {100 * high:5.1f}] %"
        f"  {arrived:>5}  {contacts:>5}  {clearance_m:7.3f} m  {lasts_s / len(seeds):6.2f} s"
        f"  {(time.perf_counter() - began) / len(seeds):5.2f} s",
        flush=True,
    )


def _per_robot(make: Callable[[], Observe]) -> Observe:
    """A separate observer for every robot: some have memory."""
    observers: dict[int, Observe] = {}
    return lambda world, sensor: observers.setdefault(id(world), make())(world, sensor)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--radius", type=float, default=6.0, help="of the circle, m")
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", default="", help="the configurations whose name holds this")
    options = parser.parse_args()
    print(
        f"{options.robots} robots, circle of {options.radius:g} m, {options.seeds} seeds; "
        "95 % intervals by Wilson"
    )
    print(
        f"{'planner':<34}  seeds without contact            goal   touch  least gap"
        "     lasts  computed in"
    )
    seeds = range(options.first, options.first + options.seeds)
    for name, configuration in CONFIGURATIONS.items():
        if options.only in name:
            measure(name, configuration, options.robots, options.radius, seeds)


if __name__ == "__main__":
    main()
