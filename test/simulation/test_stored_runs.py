# SPDX-License-Identifier: Apache-2.0
"""Short runs of every kind go where they went: what no single test states, such as a weight.

Positions are compared to a tenth of a millimetre, since other processors round functions of
numpy otherwise. A change that moves a robot on purpose stores them anew:
`python test/simulation/test_stored_runs.py`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.suites.named_suites import suite
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.peers.ablation import NoVelocities
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.planner_registry import find_factory
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.scenarios.run_config import with_perception
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.lidar_perception import LidarPerception, with_lidar
from mfba_planner.simulation.robot_model import Lidar, Noise
from mfba_planner.simulation.run_episode import run, simulate, simulate_fleet
from mfba_planner.simulation.scenario import Kidnapping, Scenario

STORED = Path(__file__).parents[1] / "data/stored_runs.json"
PREDICTIVE = preset(PlannerParams(method=Method.PREDICTIVE))
EVERY = 5  # ticks
WITHIN_M = 1e-4


def first(ticks: int) -> Callable[[object], bool]:
    """Whether a run goes on after a decision: so many times."""
    left = iter(range(ticks - 1))
    return lambda _: next(left, None) is not None


def sim(scenario: Scenario, ticks: int, params: PlannerParams = PREDICTIVE) -> Episode:
    """The first ticks of a run by `mfba sim`."""
    scenario, params = with_perception(scenario, params)
    return simulate(
        scenario,
        planner=params,
        sensor=SensorParams(),
        seed=0,
        go_on=first(ticks),
    )


def swept(factory: Any, world: Scenario, perception: str, ticks: int) -> Episode:
    """The first ticks of a run of any planner from its lidar, as a sweep does it."""
    world = with_lidar(world, perception)
    params = world.planner_params(PREDICTIVE)
    return run(
        world,
        planner=params,
        seed=0,
        path_planner=factory(params, SensorParams(), 0),
        observe=LidarPerception(perception),
        go_on=first(ticks),
    )


def fleet(ticks: int) -> Episode:
    """The first robot of some that swap places."""
    scenario, params = with_perception(load_scenario("swap"), PREDICTIVE)
    scenario = replace(scenario, robots=scenario.robots[:4])
    return simulate_fleet(
        scenario,
        planner=params,
        sensor=SensorParams(),
        seed=0,
        go_on=first(ticks),
    )[0]


def robot(scenario: Scenario, **changes: Any) -> Scenario:
    """The scenario with another robot."""
    return replace(scenario, robot=replace(scenario.robot, **changes))


ROOMS = load_scenario("rooms")
NOISE = Noise(scan_m=0.02, odom_m=0.02, odom_rad=0.02)
TURNING = {"drive": Drive.DIFFERENTIAL, "lidar": Lidar(beams=180)}
NARROW = Lidar(beams=120, fov_rad=4.7, x_m=0.15, y_m=0.05, yaw_rad=0.2, range_max_m=6.0)
RUNS: dict[str, Callable[[], Episode]] = {
    "sectors": lambda: sim(suite("random-20").world(1), 90, PlannerParams()),
    "known circles": lambda: sim(load_scenario("case2"), 60),
    "lidar, omnidirectional": lambda: sim(
        robot(suite("random-20").world(2), lidar=Lidar(beams=180)), 70
    ),
    "lidar, differential, rooms": lambda: sim(robot(ROOMS, **TURNING), 70),
    "lidar, noise": lambda: sim(robot(suite("random-20").world(3), **TURNING, noise=NOISE), 60),
    "fast obstacles": lambda: sim(robot(suite("fast-10").world(4), lidar=Lidar(beams=120)), 50),
    "narrow lidar beside the middle, maze": lambda: sim(
        robot(suite("rooms").world(4), drive=Drive.DIFFERENTIAL, lidar=NARROW), 50
    ),
    "known map": lambda: sim(
        robot(ROOMS, lidar=Lidar(beams=120)), 60, replace(PREDICTIVE, known_map=True)
    ),
    "kidnapped": lambda: sim(
        replace(
            robot(ROOMS, lidar=Lidar(beams=120), noise=NOISE),
            kidnappings=(Kidnapping(at_s=1.5, to_m=(1.0, 4.2)),),
        ),
        50,
    ),
    "late scans": lambda: swept(
        find_factory("predictive"), suite("random-10").world(5), "lidar-realistic", 50
    ),
    "without velocities": lambda: swept(NoVelocities, suite("random-10").world(9), "lidar", 30),
    **{
        name: partial(swept, find_factory(name), suite("random-20").world(6), "lidar", 40)
        for name in ("dwa", "orca", "vfh", "apf")
    },
    "fleet": lambda: fleet(80),
}


def places(episode: Episode) -> list[list[float]]:
    """Where the robot was and went to, every few ticks: x, y, yaw, waypoint x and y."""
    return [
        [round(value, 6) for value in (*tick.pose, *tick.waypoint)]
        for tick in episode.ticks[::EVERY]
    ]


@pytest.mark.parametrize("name", RUNS)
def test_a_run_goes_where_it_went(name: str) -> None:
    stored = json.loads(STORED.read_text(encoding="utf-8"))[name]
    found = places(RUNS[name]())
    assert len(found) == len(stored)
    for k, (here, there) in enumerate(zip(found, stored)):
        assert here == pytest.approx(there, abs=WITHIN_M), f"tick {k * EVERY}"


if __name__ == "__main__":
    text = ",\n".join(
        f" {json.dumps(name)}: {json.dumps(places(one()))}" for name, one in RUNS.items()
    )
    STORED.write_text(f"{{\n{text}\n}}\n", encoding="utf-8")
