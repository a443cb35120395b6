# SPDX-License-Identifier: Apache-2.0
"""A footprint in scenario files: read, refused, written, and left out where there is none."""

import json
from dataclasses import replace

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.launcher.set_option import with_robot_settings
from mfba_planner.scenarios.run_config import RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import as_written, scenario_to_dict, scenario_to_json
from mfba_planner.simulation.robot_model import Lidar, Robot

TASK = "name: x\nstart_m: [0, 0]\ngoal_m: [5, 5]\n"
LONG = "robot: {drive: differential, footprint_m: [[0.25, 0, 0.2], [-0.25, 0, 0.2]]}\n"


def refusal(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_scenario(TASK + text, "my.yaml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("my.yaml: ")
    return message.removeprefix("my.yaml: ")


def test_the_radius_around_the_circles_is_the_default() -> None:
    scenario = parse_scenario(TASK + LONG, "x")
    assert scenario.robot.footprint_m == ((0.25, 0.0, 0.2), (-0.25, 0.0, 0.2))
    assert scenario.robot_radius_m == 0.45
    wider = parse_scenario(f"{TASK}{LONG}robot_radius_m: 0.6", "x")
    assert wider.robot_radius_m == 0.6
    assert parse_scenario(f"{TASK}robot: {{footprint_m: []}}", "x").robot_radius_m == 0.3


def test_written_and_read_again_it_is_the_same() -> None:
    odd = "robot: {footprint_m: [[0.1, 0.2, 0.3], [-0.7, 0.1, 0.1]]}"
    for text in (LONG, odd):
        scenario = parse_scenario(TASK + text, "x")
        written = scenario_to_json(scenario)
        assert load_scenario(written) == scenario
        assert as_written(json.loads(written)) == scenario
        assert scenario_to_json(load_scenario(written)) == written


def test_a_robot_without_one_is_written_as_before() -> None:
    for robot in (Robot(), Robot(lidar=Lidar(beams=360))):
        scenario = replace(load_scenario("empty"), robot=robot)
        assert "footprint_m" not in scenario_to_json(scenario)
    assert "robot" not in scenario_to_dict(load_scenario("empty"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot: {footprint_m: [[0.1, 0, 0.2], [0, 0]]}",
         "robot.footprint_m circle 2=[0, 0]: not three numbers; give [x, y, radius] in "
         "base_link, m"),
        ("robot: {footprint_m: [[0.1, 0, .nan]]}",
         "robot.footprint_m circle 1=[0.1, 0, nan]: not finite, or beyond 100 m; give "
         "[x, y, radius] in base_link, m"),
        ("robot: {footprint_m: [[0.1, 0, 0]]}",
         "robot.footprint_m circle 1=[0.1, 0, 0]: radius 0; give a radius above 0 m"),
        ("robot: {footprint_m: [[0.1, 0, -1]]}",
         "robot.footprint_m circle 1=[0.1, 0, -1]: radius -1; give a radius above 0 m"),
        (f"robot: {{footprint_m: {[[0, 0, 1]] * 17}}}",
         "robot.footprint_m: 17 circles, more than 16; give fewer, larger ones"),
        ("robot: {footprint_m: wide}",
         "robot.footprint_m=wide: not a list; give circles [[x, y, radius], ...], m"),
        ("robot: {footprint_m: {front: 1}}",
         "robot.footprint_m={'front': 1}: not a list; give circles [[x, y, radius], ...], m"),
        ("robot: {footprint: [[0, 0, 1]]}",
         "robot.footprint: unknown option; did you mean 'footprint_m'?"),
        (LONG + "robot_radius_m: 0.3",
         "robot_radius_m=0.3: robot.footprint_m reaches 0.45 m from base_link; give at least "
         "that, or leave robot_radius_m out"),
        (LONG + "segments_m: [[0.4, -1, 0.4, 1]]",
         "start_m=[0.0, 0.0]: 0.05 m inside a wall segment (robot.footprint_m added); move it "
         "away from the wall"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(text: str, message: str) -> None:
    assert refusal(text) == message


def test_planner_and_sensor_get_the_radius_around_it() -> None:
    parameters = node_parameters(RunConfig(scenario=parse_scenario(TASK + LONG, "x")), ())
    for node in ("planner", "virtual_sensor"):
        assert parameters[node]["robot_radius_m"] == 0.45
        assert not any("footprint" in name for name in parameters[node])


def test_changes_of_the_robot_keep_its_shape() -> None:
    robot = parse_scenario(TASK + LONG, "x").robot
    changed, _ = with_robot_settings(robot, ["robot.lidar.beams=720"])
    assert changed.footprint_m == robot.footprint_m
    with pytest.raises(ConfigError, match=r"--set robot\.footprint_m: unknown option"):
        with_robot_settings(robot, ["robot.footprint_m=[]"])
