# SPDX-License-Identifier: Apache-2.0
"""NearbyObstacles: no obstacle within reach is missing, wherever the robot is."""

import math

import numpy as np
import pytest

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.evaluation.suites import suite
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles
from mfba_planner.simulation.nearby_obstacles import FEW
from mfba_planner.simulation.world import World

SR_M = 0.8


@pytest.mark.parametrize(
    "name", ["random-3", "random-20", "random-30", "adversarial", "turning", "dynabarn-like"]
)
def test_no_obstacle_within_reach_is_missing(name: str) -> None:
    scenario = suite(name).world(3)
    world, rng = World(scenario, 100_000_000, 0.02), np.random.default_rng(1)
    velocity, fewest = (0.6, 0.5), len(scenario.obstacles)
    for k in range(400):
        if k % 50 == 7:  # as an initial pose does
            world.pose = Pose2D(*rng.uniform(0.0, 12.0, 2).tolist())
        if k % 90 == 11:  # as a bag does
            world.tick = int(rng.integers(0, 300))
        position = world.pose.position
        circles_now = scenario.enlarged(world.time_s)
        within = [i for i, (c, r) in enumerate(circles_now) if distance(position, c) - r <= SR_M]
        which, circles = world.near(SR_M)
        assert set(within) <= set(which)
        assert which == sorted(which)
        assert circles == [circles_now[i] for i in which]
        fewest = min(fewest, len(which))
        world.step(velocity)
    assert (fewest < len(scenario.obstacles)) == (len(scenario.obstacles) > FEW)


def test_another_reach_selects_again() -> None:
    world = World(suite("random-30").world(3), 100_000_000, 0.02)
    few, all_of_them = world.near(0.1)[0], world.near(100.0)[0]
    assert len(few) < len(all_of_them) == 30
    assert world.near(0.1)[0] == few


@pytest.mark.parametrize("x", [math.nan, math.inf])
def test_a_position_that_is_not_finite_is_near_to_all(x: float) -> None:
    world = World(suite("random-3").world(0), 100_000_000, 0.02)
    world.near(SR_M)
    world.pose = Pose2D(x, 0.0)
    which, circles = world.near(SR_M)
    assert len(which) == 3
    with pytest.raises(InputError, match="not finite"):
        sense_circles(world.pose.position, circles, SensorParams())
