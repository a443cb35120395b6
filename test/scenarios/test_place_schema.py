# SPDX-License-Identifier: Apache-2.0
"""The static place of scenario files: accepted and refused input, and the form in bags."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import as_written, scenario_to_dict, scenario_to_json
from mfba_planner.scenarios.solids import Polygon, box

TASK = "name: x\nstart_m: [0, 0]\ngoal_m: [5, 5]\n"
FLEET = "[{name: a, start_m: [0, 0], goal_m: [5, 0]}, {name: b, start_m: [0, 3], goal_m: [5, 3]}]"


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


# --- polygons and boxes -----------------------------------------------------------------------


def test_polygons_and_boxes_become_their_outlines() -> None:
    text = f"{TASK}polygons_m: [[[2, 0], [3, 0], [3, 1]], [[1, 3], [2, 3], [2, 4], [1, 3]]]\n"
    scenario = parse_scenario(
        text + "boxes: [{center_m: [8, 5], size_m: [2, 1]}]\nsegments_m: [[9, 9, 9, 8]]", "x"
    )
    assert scenario.segments_m == (
        (9.0, 9.0, 9.0, 8.0),
        (2.0, 0.0, 3.0, 0.0), (3.0, 0.0, 3.0, 1.0), (3.0, 1.0, 2.0, 0.0),
        (1.0, 3.0, 2.0, 3.0), (2.0, 3.0, 2.0, 4.0), (2.0, 4.0, 1.0, 3.0),
        (9.0, 5.5, 7.0, 5.5), (7.0, 5.5, 7.0, 4.5), (7.0, 4.5, 9.0, 4.5), (9.0, 4.5, 9.0, 5.5),
    )  # fmt: skip
    assert load_scenario(scenario_to_json(scenario)) == scenario, "bags need no polygons"


def test_a_box_is_turned_by_its_yaw() -> None:
    corners = box("box", (1.0, 2.0), (4.0, 2.0), math.radians(90.0)).corners
    expected = [(0.0, 4.0), (0.0, 0.0), (2.0, 0.0), (2.0, 4.0)]
    assert [(round(x, 9), round(y, 9)) for x, y in corners] == expected


@given(x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0), yaw_rad=st.floats(-3.0, 3.0))
def test_what_a_box_covers(x: float, y: float, yaw_rad: float) -> None:
    """By the coordinates in its own frame."""
    made = box("box", (0.5, -0.5), (2.0, 1.0), yaw_rad)
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    along, across = c * (x - 0.5) + s * (y + 0.5), c * (y + 0.5) - s * (x - 0.5)
    margin = max(abs(along) - 1.0, abs(across) - 0.5)
    if abs(margin) > 1e-9:
        assert made.covers((x, y)) == (margin < 0.0)


def test_a_notch_is_not_inside() -> None:
    u_shape = [
        (0.0, 0.0),
        (3.0, 0.0),
        (3.0, 3.0),
        (2.0, 3.0),
        (2.0, 1.0),
        (1.0, 1.0),
        (1.0, 3.0),
        (0.0, 3.0),
    ]
    polygon = Polygon("polygon", u_shape)
    assert not polygon.covers((1.5, 2.0))
    assert polygon.covers((0.5, 2.0))
    assert polygon.covers((1.5, 0.5))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("polygons_m: [[[1, 2], [3, 4]]]", "polygon 1: 2 corners; give three or more"),
        ("polygons_m: [[[1, 2], [3, 4], [1, 2]]]", "polygon 1: 2 corners; give three or more"),
        ("polygons_m: [[[1, 2], [1, 2], [3, 4], [3, 2]]]",
         "polygon 1: corner 1 given twice running; remove one"),
        ("polygons_m: [[[1, 0], [2, 0], [2, 1]], [[1, 2], [3, 4], [3, 2], [1, 4]]]",
         "polygon 2: edges 1 and 3 cross or touch; "
         "sort the corners along the outline, or split the polygon"),
        ("polygons_m: [[[1, 2], [3, 2], [3, 4], [2, 2], [1, 4]]]",
         "polygon 1: edges 1 and 3 cross or touch; "
         "sort the corners along the outline, or split the polygon"),
        ("polygons_m: [[[1, 2], [3, 2], [2, 2]]]",
         "polygon 1: turns back on itself at corner 2; remove that corner"),
        ("polygons_m: [[[1, 2], [3, .nan], [2, 2]]]",
         "polygons_m.1.2.2=nan: refused; give a finite number"),
        ("polygons_m: [[1, 2, 3]]",
         "polygons_m.1.1=1: refused; give corners of two numbers, [[x, y], ...]"),
        ("polygons_m: [[[-1, -1], [1, -1], [1, 1], [-1, 1]]]",
         "start_m=[0.0, 0.0]: inside polygon 1; "
         "move it out (the walls of a room are segments_m)"),
        ("boxes: [{center_m: [5, 5], size_m: [2, 2], yaw_deg: 30}]",
         "goal_m=[5.0, 5.0]: inside box 1; move it out (the walls of a room are segments_m)"),
        ("boxes: [{center_m: [3, 3], size_m: [0, 2]}]",
         "boxes.1.size_m.1=0: refused; give a number greater than 0"),
        ("boxes: [{center_m: [3, 3], size_m: [1, -2]}]",
         "boxes.1.size_m.2=-2: refused; give a number greater than 0"),
        ("boxes: [{center_m: [3, 3], size_m: [1, 2], yaw: 3}]",
         "boxes.1.yaw: unknown key; did you mean 'yaw_deg'?"),
        ("boxes: [{center_m: [3, 3]}]",
         "boxes.1.size_m: missing; add it (compare config/scenarios/case1.yaml)"),
        ("boxes: [{center_m: [0.9, 0], size_m: [1.4, 1]}]",
         "start_m=[0.0, 0.0]: 0.1 m inside a wall segment (robot_radius_m added); "
         "move it away from the wall"),
        ("kidnappings: [{at_s: 3, to_m: [2, 2]}]\nboxes: [{center_m: [2, 2], size_m: [3, 3]}]",
         "kidnapping to_m=[2.0, 2.0]: inside box 1; "
         "move it out (the walls of a room are segments_m)"),
    ],
)  # fmt: skip
def test_refused_polygons_and_boxes(text: str, message: str) -> None:
    assert refusal(TASK + text) == message


def test_a_robot_of_a_fleet_inside_a_box() -> None:
    a, b = (
        "{name: a, start_m: [0, 0], goal_m: [5, 0]}",
        "{name: b, start_m: [0, 3], goal_m: [5, 3]}",
    )
    text = f"name: x\nrobots: [{a}, {b}]\nboxes: [{{center_m: [5, 3], size_m: [2, 2]}}]"
    assert refusal(text) == (
        "robot b goal_m=[5.0, 3.0]: inside box 1; move it out (the walls of a room are segments_m)"
    )
