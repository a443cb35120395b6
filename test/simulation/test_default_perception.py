# SPDX-License-Identifier: Apache-2.0
"""What the planner perceives by default, and one robot radius for scenario, sensor and planner."""

from dataclasses import replace

import pytest

from mfba_planner.core.planner_types import Mode
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import Method, PerceptionInput, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.scenarios.run_config import with_perception
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario

PREDICTIVE = replace(preset(), method=Method.PREDICTIVE)


def simulated(scenario: Scenario, planner: PlannerParams, seed: int = 0) -> Episode:
    scenario, planner = with_perception(scenario, planner)
    return simulate(scenario, planner=planner, sensor=SensorParams(), seed=seed)


@pytest.mark.no_cover
@pytest.mark.parametrize("drive", Drive)
@pytest.mark.parametrize("radius_m", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("obstacle_m", [0.05, 0.3, 1.0])
def test_a_robot_of_any_radius_passes_a_disc_of_any_radius(
    drive: Drive, radius_m: float, obstacle_m: float
) -> None:
    scenario = Scenario(
        name="disc", start_m=(0.0, 0.0), goal_m=(8.0, 0.0), robot_radius_m=radius_m,
        obstacles=(Obstacle(center_m=(4.0, 0.1), radius_m=obstacle_m),),
        robot=Robot(drive=drive),
    )  # fmt: skip
    result = evaluate(simulated(scenario, replace(PREDICTIVE, goal_tolerance_m=0.1)))
    assert result.success
    assert 0.0 < result.min_clearance_m < 0.4


def test_every_decision_says_what_it_perceived_by() -> None:
    case = load_scenario("case2")
    sectors = replace(PREDICTIVE, perception=PerceptionInput.SECTORS)
    for planner, expected in (
        (PREDICTIVE, "scan"),
        (sectors, "sectors"),
        (PlannerParams(), "sectors"),
    ):
        ticks = simulated(case, planner).ticks
        assert {tick.perception for tick in ticks} == {expected}
        assert ticks[-1].mode is Mode.ARRIVED


@pytest.mark.no_cover
def test_case_2_by_default_is_within_a_hundredth_of_the_optimum() -> None:
    optimum_m = 17.0  # by the oracle, rounded up: see docs/reproduction.md
    lengths = [
        evaluate(simulated(load_scenario("case2"), PREDICTIVE, seed)).length_m for seed in range(5)
    ]
    assert max(lengths) < 1.01 * optimum_m


def test_a_lidar_is_kept_as_it_is() -> None:
    robot = Robot(lidar=Lidar(beams=90, range_max_m=2.0))
    scenario = replace(load_scenario("case1"), robot=robot)
    assert with_perception(scenario, PREDICTIVE)[0] == scenario
    assert with_perception(scenario, PlannerParams())[0] == scenario


@pytest.mark.parametrize("drive", Drive)
def test_whole_numbers_are_numbers(drive: Drive) -> None:
    """A scenario written in Python with integers: the same decisions as with floats."""
    digests = []
    for number in (int, float):
        scenario = Scenario(
            name="whole",
            start_m=(number(0), number(0)),
            goal_m=(number(5), number(0)),
            obstacles=(
                Obstacle(center_m=(number(2), number(0)), radius_m=number(1)),
                Obstacle(center_m=(number(3), number(2)), radius_m=number(1), speed_mps=number(1)),
            ),
            segments_m=((number(1), number(-2), number(4), number(-2)),),
            robot=Robot(drive=drive, lidar=Lidar(beams=360)),
        )
        params = replace(PREDICTIVE, speed_mps=number(1))
        episode = simulate(scenario, planner=params, sensor=SensorParams(), seed=0)
        digests.append(digest(episode.ticks))
    assert digests[0] == digests[1]
