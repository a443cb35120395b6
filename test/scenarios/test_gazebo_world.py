# SPDX-License-Identifier: Apache-2.0
"""Gazebo worlds as scenarios: poses composed, boxes, what is lost, and bad files in one line."""

import math
from pathlib import Path

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios.importers.gazebo_world import LOST_HEADING, read_world
from mfba_planner.scenarios.importers.imported import Imported, ImportOptions, Source


def cylinder(pose: str, radius: str = "0.075", length: str = "1", name: str = "c") -> str:
    shape = f"<cylinder><radius>{radius}</radius><length>{length}</length></cylinder>"
    return model(shape, pose, name)


def model(shape: str, pose: str, name: str = "m", inner: str = "") -> str:
    return (
        f"<model name='{name}'><static>1</static><pose frame=''>{pose}</pose><link name='link'>"
        f"<collision name='c'>{inner}<geometry>{shape}</geometry></collision></link></model>"
    )


def world(*models: str) -> str:
    return f"<sdf version='1.6'><world name='default'>{''.join(models)}</world></sdf>"


def read(text: str, **options: object) -> Imported:
    return read_world(Source(text, "w", Path()), ImportOptions(**options))  # type: ignore[arg-type]


def test_a_world_of_cylinders_has_the_task_of_barn() -> None:
    ground = model("<plane><normal>0 0 1</normal></plane>", "0 0 0 0 0 0", "ground_plane")
    sun = "<include><uri>model://sun</uri></include>"
    found = read(world(sun, ground, cylinder("-0.075 0.075 0.5 0 -0 0"), cylinder("1 2 0 0 0 3")))
    assert found.lost == [LOST_HEADING]
    assert found.scenarios == [
        {
            "name": "w",
            "description": "imported from a Gazebo world",
            "start_m": [-2.25, 3.0],
            "goal_m": [-2.25, 13.0],
            "robot_radius_m": 0.22,
            "time_limit_s": 100.0,
            "obstacles": [
                {"center_m": [-0.075, 0.075], "radius_m": 0.075},
                {"center_m": [1.0, 2.0], "radius_m": 0.075},
            ],
        }
    ]


def test_options_replace_the_task_of_barn() -> None:
    plain = read(
        world(cylinder("1 2 0 0 0 0")), start_m=(5.0, 6.0), goal_m=(7.0, 8.0), robot_radius_m=0.3,
        time_limit_s=30.0,
    ).scenarios[0]  # fmt: skip
    assert (plain["start_m"], plain["goal_m"]) == ([5.0, 6.0], [7.0, 8.0])
    assert (plain["robot_radius_m"], plain["time_limit_s"]) == (0.3, 30.0)


def test_poses_of_model_link_and_collision_are_composed() -> None:
    half_turn = f"{math.pi / 2:.12f}"
    text = world(
        "<model name='outer'><pose>10 0 0 0 0 " + half_turn + "</pose>"
        "<link name='l'><pose>1 0 0 0 0 0</pose><collision name='c'><pose>0 2 0 0 0 0</pose>"
        "<geometry><sphere><radius>0.4</radius></sphere></geometry></collision></link>"
        "<model name='inner'><pose>0 5 0 0 0 0</pose><link name='l'><collision name='c'>"
        "<geometry><cylinder><radius>0.2</radius><length>1</length></cylinder></geometry>"
        "</collision></link></model></model>"
    )
    circles = read(text).scenarios[0]["obstacles"]
    assert circles == [
        {"center_m": [8.0, 1.0], "radius_m": 0.4},
        {"center_m": [5.0, 0.0], "radius_m": 0.2},
    ]


def test_a_saved_state_moves_a_model() -> None:
    state = (
        "<state world_name='default'><model name='c'><pose>3 4 0.5 0 0 0</pose></model></state>"
    )
    (circle,) = read(world(cylinder("0 0 0.5 0 0 0"), state)).scenarios[0]["obstacles"]
    assert circle["center_m"] == [3.0, 4.0]


def test_boxes_become_boxes() -> None:
    box = "<box><size>4 0.2 1</size></box>"
    plain = read(world(model(box, "1 2 0.5 0 0 0.5"), model(box, "0 0 0.5 0 0 0"))).scenarios[0]
    assert plain["boxes"] == [
        {"center_m": [1.0, 2.0], "size_m": [4.0, 0.2], "yaw_deg": round(math.degrees(0.5), 6)},
        {"center_m": [0.0, 0.0], "size_m": [4.0, 0.2]},
    ]
    assert plain["obstacles"] == []


def test_what_is_lost_is_named_and_counted() -> None:
    mesh = "<mesh><uri>model://chair.dae</uri></mesh>"
    found = read(
        world(
            cylinder("1 1 0.5 0 0 0"),
            cylinder("1 1 0.5 1.57 0 0"),
            model(mesh, "0 0 0 0 0 0"),
            model(mesh, "2 0 0 0 0 0"),
            model("<box><size>9 9 0.1</size></box>", "0 0 -0.05 0 0 0"),
            "<include><uri>model://table</uri></include>",
            "<actor name='walker'/>",
        )
    )
    assert len(found.scenarios[0]["obstacles"]) == 1
    assert found.lost == [
        LOST_HEADING,
        "1 x cylinder that lies or leans",
        "2 x <mesh> as a shape",
        "1 x shape that ends below 0.05 m, as a floor does",
        "1 x <include> of model://table, which is not in the file",
        "1 x <actor> of walker, which is not in the file",
    ]


BOMB = '<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY lol "lol"><!ENTITY a "&lol;&lol;">]>'


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("   \n", "empty"),
        ("name: yaml", "not XML"),
        ("<sdf><world>", "not XML"),
        ("<robot name='x'/>", "<robot> without a <world>"),
        (BOMB + world(cylinder("0 0 0 0 0 0")), "a document type"),
        (world(), "no cylinder, sphere or box in it; give"),
        (world(model("<mesh/>", "0 0 0 0 0 0")), r"no cylinder.*lost: 1 x <mesh> as a shape"),
        (world(cylinder("0 0 0")), "pose '0 0 0': not six numbers"),
        (world(cylinder("0 0 nan 0 0 0")), "pose=nan: not finite"),
        (world(cylinder("0 0 0 0 0 x")), "pose='x': not a number"),
        (world(cylinder("0 0 0 0 0 0", "-1")), "radius=-1: not above 0"),
        (world(cylinder("0 0 0 0 0 0", "")), "radius='': not a number"),
        (world(model("<box><size>1 2</size></box>", "0 0 0 0 0 0")), "box of size '1 2'"),
        (world(*[cylinder("0 0 0 0 0 0")] * 5001), "5001 models: more than 5000"),
    ],
)
def test_bad_worlds_are_refused_in_one_line(text: str, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_a_hundred_thousand_models_are_refused_soon() -> None:
    with pytest.raises(ConfigError, match="models: more than 5000"):
        read(world(cylinder("0 0 0 0 0 0") * 100_000))
