# SPDX-License-Identifier: Apache-2.0
"""The planner of a robot imports nothing while it drives: an import takes a tick and more."""

import subprocess
import sys

import pytest

DRIVE = """
import sys
from dataclasses import replace
from mfba_planner.evaluation.suites.named_suites import suite
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_factory import {make}
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.simulation.lidar_perception import with_lidar
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.world import World

scenario = with_lidar(suite("random-30").world(90001), {perception!r})
params = scenario.planner_params(preset(PlannerParams(method=Method.PREDICTIVE)))
planner = {make}(params, seed=0)
world = World(scenario, params.tick_ns, params.goal_tolerance_m)
imported = set()
for _ in range(40):
    observation = replace(observe_scan(world, SensorParams()), goal=scenario.goal_m)
    before = set(sys.modules)
    decision = planner.plan(observation)
    imported |= set(sys.modules) - before
    world.step(world.command(decision))
print("imported", *sorted(imported))
"""


def imported(make: str, perception: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", DRIVE.format(make=make, perception=perception)],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return set(done.stdout.splitlines()[-1].split()[1:])


@pytest.mark.parametrize("perception", ["lidar", "lidar-differential"])
def test_decisions_of_a_loaded_planner_import_nothing(perception: str) -> None:
    assert imported("make_loaded_planner", perception) == set()


def test_the_drive_needs_what_is_loaded() -> None:
    assert {"eikonalfm", "scipy.ndimage"} <= imported("make_planner", "lidar")
