# SPDX-License-Identifier: Apache-2.0
"""100 seeded kidnappings, at a random tick to a random free position: whether the robot arrives.

Run: python bench/kidnapped.py [--count N] [--graph N]. Kidnapping k is drawn from seed k: case 1
or 2 in turn, a moment of its undisturbed run, a position in the 12 x 12 m that is 0.1 m clear of
all obstacles. Rows: planner and robot. --graph lets the real graph do the first N of them
as well (in one process, over DDS) and holds its decisions against the core's.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from mfba_planner.core.geometry import distance
from mfba_planner.core.planner_types import NANO
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.ros_domain import claim_domain
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.odometry_jump import is_odometry_jump
from mfba_planner.planning.planner_params import Method, PlannerParams, Swarm
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Kidnapping, Scenario

ROOM_M, CLEAR_M = 12.0, 0.1
AHEAD = replace(preset(), method=Method.PREDICTIVE)
TURNING = Robot(drive=Drive.DIFFERENTIAL, lidar=Lidar(beams=360))
ROWS: dict[str, tuple[Robot, PlannerParams]] = {
    "paper, omnidirectional": (Robot(), PlannerParams()),
    "paper with a persistent swarm": (Robot(), PlannerParams(swarm=Swarm.PERSISTENT)),
    "predictive, omnidirectional": (Robot(), AHEAD),
    "predictive, differential, 360 beams": (TURNING, AHEAD),
}


def run_core(scenario: Scenario, params: PlannerParams, seed: int) -> Episode:
    """Simulate a run with the core driver."""
    return simulate(scenario, planner=params, sensor=SensorParams(), seed=seed)


def kidnapped(k: int, robot: Robot, params: PlannerParams) -> Scenario:
    """The scenario of kidnapping k: drawn from its undisturbed run."""
    case = replace(load_scenario(("case1", "case2")[k % 2]), robot=robot)
    ticks = len(run_core(case, params, k).ticks)
    rng = np.random.default_rng((20, k))
    at_s = int(rng.integers(1, ticks - 1)) * params.tick_ns * NANO
    circles = case.enlarged(at_s)
    while True:
        x, y = rng.uniform(0.0, ROOM_M, size=2).tolist()
        if all(distance((x, y), center) > radius + CLEAR_M for center, radius in circles):
            return replace(case, kidnappings=(Kidnapping(at_s=at_s, to_m=(x, y)),))


def by_graph(scenario: Scenario, params: PlannerParams, seed: int) -> str:
    """The decision digest of the same run through the real graph."""
    from mfba_planner.launcher.in_process_driver import run_in_process

    config = RunConfig(scenario=scenario, planner=params, seed=seed, driver=Driver.IN_PROCESS)
    domain, lock = claim_domain()
    with lock, tempfile.TemporaryDirectory() as directory:
        bag = Path(directory) / "bag"
        run_in_process(config, bag, domain_id=domain)
        return digest(read_episode(bag).ticks)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--graph", type=int, default=0)
    found = parser.parse_args()
    for name, (robot, params) in ROWS.items():
        arrived = clean = noticed = equal = 0
        for k in range(found.count):
            scenario = kidnapped(k, robot, params)
            episode = run_core(scenario, params, k)
            arrived += episode.outcome is Outcome.GOAL_REACHED
            clean += evaluate(episode).success
            noticed += any(is_odometry_jump(tick.reason) for tick in episode.ticks)
            if k < found.graph:
                equal += by_graph(scenario, params, k) == digest(episode.ticks)
        graph = f"; graph: {equal} of {found.graph} digests equal" if found.graph else ""
        print(
            f"{name:36} arrived {arrived} of {found.count}, without contact {clean}, "
            f"noticed {noticed}{graph}",
            flush=True,
        )


if __name__ == "__main__":
    main()
