# SPDX-License-Identifier: Apache-2.0
"""The static place of scenario files: accepted and refused input, and the form in bags."""

import json

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import as_written, scenario_to_dict, scenario_to_json

TASK = "name: x\nstart_m: [0, 0]\ngoal_m: [5, 5]\n"


def refusal(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_scenario(text, "my.yaml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("my.yaml: ")
    return message.removeprefix("my.yaml: ")


def test_segments_and_back() -> None:
    scenario = parse_scenario(f"{TASK}segments_m: [[1, 2, 3, 4.5], [-1, 0, -1, 2]]", "x")
    assert scenario.segments_m == ((1.0, 2.0, 3.0, 4.5), (-1.0, 0.0, -1.0, 2.0))
    assert load_scenario(scenario_to_json(scenario)) == scenario
    assert as_written(json.loads(scenario_to_json(scenario))) == scenario


def test_a_scenario_without_segments_is_written_as_before() -> None:
    assert "segments_m" not in scenario_to_dict(parse_scenario(TASK, "x"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("segments_m: [[1, 2, 3, .nan]]",
         "segments_m.1.4=nan: refused; give a finite number"),
        ("segments_m: [[1, 2, 3, 4], [1, 2, 3]]",
         "segments_m.2.4: missing; add it (compare config/scenarios/case1.yaml)"),
        ("segments_m: [[1, 2, 3, 4, 5]]",
         "segments_m.1=[1, 2, 3, 4, 5]: refused; give four numbers, [x0, y0, x1, y1]"),
        ("segments_m: [3]", "segments_m.1=3: refused; give four numbers, [x0, y0, x1, y1]"),
        ("segments_m: 3", "segments_m=3: refused; give a list ([] for none)"),
        ("segments_m: [[1, 2, 3, '4']]", "segments_m.1.4='4': refused; give a number"),
        ("segments_m: [[9, 1, 9, 2], [1, 2, 1, 2]]",
         "segment 2 [1, 2, 1, 2]: of length 0; give two different ends"),
        ("segments_m: [[-1, 0.2, 1, 0.2]]",
         "start_m=[0.0, 0.0]: 0.1 m inside a wall segment (robot_radius_m added); "
         "move it away from the wall"),
        ("segments_m: [[5.1, 5, 9, 5]]",
         "goal_m=[5.0, 5.0]: 0.2 m inside a wall segment (robot_radius_m added); "
         "move it away from the wall"),
        ("kidnappings: [{at_s: 3, to_m: [2, 2]}]\nsegments_m: [[2, 1, 2, 3]]",
         "kidnapping to_m=[2.0, 2.0]: 0.3 m inside a wall segment (robot_radius_m added); "
         "move it away from the wall"),
    ],
)  # fmt: skip
def test_refused_segments(text: str, message: str) -> None:
    assert refusal(TASK + text) == message


def test_every_robot_of_a_fleet_needs_room() -> None:
    members = (
        "[{name: a, start_m: [0, 0], goal_m: [5, 0]}, {name: b, start_m: [0, 3], goal_m: [5, 3]}]"
    )
    text = f"name: x\nrobots: {members}\nsegments_m: [[5, 2.9, 9, 2.9]]"
    assert refusal(text).startswith("goal_m=[5.0, 3.0]: 0.2 m inside a wall segment")


def test_a_robot_may_start_in_touch_with_a_wall() -> None:
    assert parse_scenario(f"{TASK}segments_m: [[-1, 0.3, 1, 0.3]]", "x").segments_m
