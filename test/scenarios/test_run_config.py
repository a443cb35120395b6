# SPDX-License-Identifier: Apache-2.0
"""RunConfig: the parameters of each node, and refused configurations."""

from dataclasses import replace
from typing import Any

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.robot_base import Drive
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.scenarios.run_config import NODES, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.robot_model import Lidar, Robot

CASE1 = load_scenario("case1")


def test_in_lockstep_the_planner_gets_its_parameters_unchanged() -> None:
    parameters = node_parameters(RunConfig(scenario=CASE1, seed=5, speed_factor=0.1), NODES)
    assert set(parameters) == set(NODES)
    assert parameters["planner"].items() >= {**flatten(PlannerParams()), "seed": 5}.items()
    assert all(parameters[name]["lockstep"] for name in NODES)
    assert all(parameters[name]["wait_for"] == ",".join(NODES) for name in NODES)
    assert parameters["world_sim"]["tick_ns"] == PlannerParams().tick_ns


@pytest.mark.parametrize(
    ("speed_factor", "timeout_s"), [(1.0, 1.0), (0.1, 10.0), (20.0, 1.0), (0.01, 100.0)]
)
def test_in_slow_motion_inputs_are_stale_later(speed_factor: float, timeout_s: float) -> None:
    config = RunConfig(scenario=CASE1, real_time=True, speed_factor=speed_factor)
    parameters = node_parameters(config, ())
    assert parameters["planner"]["input_timeout_s"] == pytest.approx(timeout_s)
    assert parameters["world_sim"]["speed_factor"] == speed_factor
    assert not any(parameters[name]["lockstep"] for name in NODES)


def test_in_real_time_a_timeout_within_a_tick_is_refused() -> None:
    slow = PlannerParams(step_length_m=0.5, speed_mps=0.25)
    RunConfig(scenario=CASE1, planner=slow)
    with pytest.raises(ConfigError, match=r"^planner.input_timeout_s=1: a tick takes 2 s, so in"):
        RunConfig(scenario=CASE1, planner=slow, real_time=True)


def test_a_robot_that_cannot_stop_within_what_it_sees_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"sees only 0.80 m ahead: .* step_length_m to 0.8, or"):
        RunConfig(scenario=CASE1, planner=PlannerParams(step_length_m=1.0))
    fast = preset(PlannerParams(method=Method.PREDICTIVE, speed_mps=3.0))
    robot = Robot(drive=Drive.DIFFERENTIAL, max_speed_mps=3.0, lidar=Lidar(beams=360))
    RunConfig(scenario=replace(CASE1, robot=robot), planner=fast)
    short = replace(robot, lidar=Lidar(beams=360, range_max_m=1.5))
    with pytest.raises(ConfigError, match=r"^speed_mps=3: .* speed_mps to 2.36, or give a lidar"):
        RunConfig(scenario=replace(CASE1, robot=short), planner=fast)
    # The paper's planner reads the sectors of that lidar.
    RunConfig(scenario=replace(CASE1, robot=short), planner=PlannerParams())


def test_a_world_without_obstacles_leaves_the_sensor_its_default_radii() -> None:
    empty = node_parameters(RunConfig(scenario=load_scenario("empty")), ())
    walled = node_parameters(RunConfig(scenario=load_scenario("walled")), ())
    assert "obstacle_radii_m" not in empty["virtual_sensor"]
    assert walled["virtual_sensor"]["obstacle_radii_m"] == [0.5, 0.3, 0.2, 0.4]


def test_values_out_of_range_are_refused() -> None:
    for bad in ({"seed": -1}, {"speed_factor": 0.0}, {"real_time": 1}):
        with pytest.raises(ConfigError, match=next(iter(bad))):
            RunConfig(scenario=CASE1, **bad)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "dated"),
    [
        ({"real_time": True}, True),
        ({"real_time": True, "speed_factor": 0.5}, True),
        ({"real_time": True, "speed_factor": 2.0}, False),
        ({}, False),
    ],
)
def test_inputs_are_dated_by_the_worlds_clock_where_it_is_not_faster(
    changes: dict[str, Any], dated: bool
) -> None:
    parameters = node_parameters(RunConfig(scenario=CASE1, **changes), NODES)
    for node in ("planner", "virtual_sensor"):
        assert parameters[node].get("use_sim_time", False) is dated
    assert "use_sim_time" not in parameters["world_sim"], "it publishes that clock"
