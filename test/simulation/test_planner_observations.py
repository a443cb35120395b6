# SPDX-License-Identifier: Apache-2.0
"""Which observations of the simulated world hold wall segments."""

import math

import numpy as np
import pytest

from mfba_planner.perception.sensory_vector import SensorParams, sensory_vector
from mfba_planner.simulation.planner_observations import Perception, observe_scan, observe_sectors
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.world import World

SENSOR = SensorParams()
TICK_NS = 100_000_000
PAPER = Robot()


def beside_a_wall(robot: Robot = PAPER) -> World:
    """A wall 1 m to the right, and another that is out of SR."""
    task = Scenario(
        name="x", start_m=(0.0, 0.0), goal_m=(9.0, 9.0), robot=robot,
        segments_m=((1.0, -9.0, 1.0, 9.0), (-1.3, -9.0, -1.3, 9.0)),
    )  # fmt: skip
    return World(task, TICK_NS, 0.1)


def test_sectors_of_the_ring_and_of_a_lidar_agree() -> None:
    expected = (1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1)
    assert sensory_vector(observe_sectors(beside_a_wall(), SENSOR).ranges_m) == expected
    scanning = beside_a_wall(Robot(lidar=Lidar(beams=1080)))
    assert sensory_vector(observe_sectors(scanning, SENSOR).ranges_m) == expected


def test_a_lidar_sees_as_far_as_it_sees() -> None:
    obs = observe_scan(beside_a_wall(Robot(lidar=Lidar(beams=360))), SENSOR)
    assert obs.scan is not None
    ranges = obs.scan.ranges_m
    assert ranges.min() == pytest.approx(1.0, abs=1e-3)
    assert ranges[150:210].min() == pytest.approx(1.3, abs=1e-3)


@pytest.mark.parametrize("name", ["scan-12", "scan-360"])
def test_scans_of_equal_sensing_range_hold_walls_up_to_it(name: str) -> None:
    obs = Perception(name)(beside_a_wall(), SENSOR)
    assert obs.scan is not None
    found = obs.scan.ranges_m[np.isfinite(obs.scan.ranges_m)]
    assert found.size
    assert 1.0 <= found.min() <= 1.04
    assert found.max() <= SENSOR.sensing_range_m + 0.3 + 1e-6, "the far wall is out of range"
    assert obs.ranges_m[0] == pytest.approx(0.7, abs=0.05)


def test_known_circles_hold_no_walls_but_their_sectors_do() -> None:
    obs = Perception("known")(beside_a_wall(), SENSOR)
    assert obs.circles == ()
    assert obs.ranges_m[0] == pytest.approx(0.7)
    assert obs.ranges_m[5] == math.inf
