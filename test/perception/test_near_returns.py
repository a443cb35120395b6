# SPDX-License-Identifier: Apache-2.0
"""A lidar whose range_min is beyond the robot's radius: what is nearer counts as contact."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mfba_planner.core.planner_types import Scan
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.perception.near_returns import blind_ring, near_at_contact
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario

SCAN = Scan(
    ranges_m=np.array([math.inf, -math.inf, 0.3, 0.7, math.nan] + [math.inf] * 7),
    angle_min_rad=math.radians(15.0),
    angle_increment_rad=math.radians(30.0),
    range_min_m=0.5,
    range_max_m=10.0,
)


def test_only_minus_infinity_is_taken_at_the_robot_s_edge() -> None:
    scan = near_at_contact(SCAN, 0.2)
    assert scan.range_min_m == 0.2
    assert np.array_equal(
        scan.ranges_m[:5], [math.inf, -math.inf, math.nan, 0.7, math.nan], equal_nan=True
    )
    assert near_at_contact(SCAN, 0.5) is SCAN
    assert (
        near_at_contact(replace(SCAN, range_min_m=float(np.float32(0.3))), 0.3).range_min_m > 0.3
    )


def test_the_warning_names_values_and_remedy() -> None:
    assert blind_ring(SCAN, 0.5) == ""
    assert blind_ring(SCAN, 0.2) == (
        "the lidar's range_min=0.5 m is beyond robot_radius_m=0.2: it does not tell where "
        "something between the two is; set robot_radius_m to 0.5, or use a lidar that sees nearer"
    )


@pytest.mark.parametrize("y", [0.0, 0.2, 0.4])
def test_no_contact_with_what_stands_ahead(y: float) -> None:
    scenario = Scenario(
        name="near",
        start_m=(0.0, 0.0),
        goal_m=(4.0, 0.0),
        obstacles=(Obstacle(center_m=(2.0, y), radius_m=0.3),),
        robot=Robot(lidar=Lidar(beams=360, range_min_m=0.5)),
        time_limit_s=20.0,
    )
    params = preset(PlannerParams(method=Method.PREDICTIVE))
    episode = simulate(scenario, planner=params, sensor=SensorParams(), seed=0)
    assert evaluate(episode).collisions == 0
