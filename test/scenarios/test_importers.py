# SPDX-License-Identifier: Apache-2.0
"""Recordings, DynaBARN, Arena and IR-SIM as scenarios: small files of each, and bad ones."""

import copy
import json
import math
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios.importers.arena import read_arena
from mfba_planner.scenarios.importers.crossings import trajectory
from mfba_planner.scenarios.importers.dynabarn import read_dynabarn
from mfba_planner.scenarios.importers.gazebo_world import read_world
from mfba_planner.scenarios.importers.import_files import import_files
from mfba_planner.scenarios.importers.imported import ImportOptions, Source
from mfba_planner.scenarios.importers.ir_sim import read_ir_sim
from mfba_planner.scenarios.importers.people_recording import (
    csv_tracks,
    eth_ucy_tracks,
    read_csv,
)
from mfba_planner.scenarios.scenario_files import parse_scenario
from mfba_planner.simulation.obstacle_motion import center_at
from mfba_planner.simulation.recorded_motion import is_present


def source(text: str, folder: Path = Path()) -> Source:
    return Source(text, "w", folder)


def walkers() -> list[tuple[float, int, float, float]]:
    """Thirty people who cross 12 m in both directions, one every 2 s; sampled every 0.4 s."""
    rows = []
    for person in range(30):
        begin, sign = 2.0 * person, 1.0 if person % 2 else -1.0
        lane = 1.0 + (person * 37 % 100) / 10.0
        for k in range(25):
            t = 0.4 * k
            rows.append((begin + t, person, 6.0 + sign * (1.25 * t - 6.0), lane))
    return rows


def csv_text() -> str:
    lines = (f"{t:.3f},{person},{x:.3f},{y:.3f}" for t, person, x, y in walkers())
    return "\n".join(["t_s,person,x_m,y_m", *lines]) + "\n"


def test_a_recording_becomes_crossings_among_its_people() -> None:
    text = csv_text()
    found = read_csv(source(text), ImportOptions(count=4, seed=3, person_radius_m=0.25))
    assert [plain["name"] for plain in found.scenarios] == ["w-0", "w-1", "w-2", "w-3"]
    again = read_csv(source(text), ImportOptions(count=4, seed=3, person_radius_m=0.25))
    assert again == found
    tracks = csv_tracks(text)
    for plain in found.scenarios:
        scenario = parse_scenario(json.dumps(plain), "x")
        t0 = float(plain["description"].split()[-3])
        there = 0
        for t in np.arange(0.0, 59.0, 1.7).tolist():
            sensed = [
                center_at(o, t) for o in scenario.obstacles if is_present(o, t)
            ]  # fmt: skip
            recorded = [
                (float(np.interp(t0 + t, times, points[:, 0])), float(points[0, 1]))
                for times, points in tracks
                if times[0] + 1e-3 <= t0 + t <= times[-1] - 1e-3
            ]
            there += len(recorded)
            assert np.allclose(sorted(sensed), sorted(recorded), atol=2e-3)
        assert there > 20


def test_one_crossing_every_so_many_seconds() -> None:
    options = ImportOptions(count=3, every_s=5.0)
    found = read_csv(source(csv_text()), options)
    moments = [float(plain["description"].split()[-3]) for plain in found.scenarios]
    assert set(moments) <= {0.0, 5.0, 10.0}
    skipped = 3 - len(moments)
    assert found.lost == ([f"{skipped} moments without a crossing"] if skipped else [])


def test_start_and_goal_may_be_given() -> None:
    options = ImportOptions(count=2, start_m=(6.0, 0.0), goal_m=(6.0, 12.0), time_limit_s=20.0)
    for plain in read_csv(source(csv_text()), options).scenarios:
        assert (plain["start_m"], plain["goal_m"]) == ([6.0, 0.0], [6.0, 12.0])
        assert max(p["trajectory"][-1][0] for p in plain["obstacles"]) < 21.0
    with pytest.raises(ConfigError, match="only one is given"):
        read_csv(source(csv_text()), ImportOptions(start_m=(0.0, 0.0)))


def test_a_trajectory_is_cut_at_the_start_and_after_the_limit() -> None:
    track = (np.array([0.0, 1.0, 2.0, 3.0]), np.array([[0.0, 0], [1, 0], [2, 0], [3, 0]]))
    assert trajectory(track, 0.5, 1.0) == [
        [0.0, 0.5, 0.0], [0.5, 1.0, 0.0], [1.5, 2.0, 0.0],
    ]  # fmt: skip
    assert trajectory(track, -2.0, 60.0)[0] == [2.0, 0.0, 0.0]
    assert trajectory(track, 1.0, 60.0)[0] == [0.0, 1.0, 0.0]


def test_eth_and_ucy_text() -> None:
    plain = "".join(f"{round(t * 25)}\t{p}.0\t{x:.3f}\t{y:.3f}\n" for t, p, x, y in walkers())
    one = csv_tracks(csv_text())
    two = eth_ucy_tracks(plain, 25.0)
    obsmat = "0 1 8.4 0 3.5 1 0 0\n6 1 9.5 0 3.7 1 0 0\n"
    ((times, points),) = eth_ucy_tracks(obsmat, 15.0)
    assert (times.tolist(), points.tolist()) == ([0.0, 0.4], [[8.4, 3.5], [9.5, 3.7]])
    assert all(np.allclose(a, b) for u, v in zip(one, two, strict=True) for a, b in zip(u, v))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no column t_s"),
        ("a,b\n1,2\n", "no column t_s; give t_s, person, x_m, y_m"),
        ("t_s,person,x_m,y_m\n", "no person with two samples"),
        ("t_s,person,x_m,y_m\n0,1,0,0\n", "no person with two samples"),
        ("t_s,person,x_m,y_m\n0,1,nan,0\n", "line 2: value=nan: not finite"),
        ("t_s,person,x_m,y_m\n0,1,0\n", "line 2: value='None': not a number"),
        ("t_s,person,x_m,y_m\n1,1,0,0\n0,1,1,0\n", "time 0 s after 1 s; sort"),
        ("t_s,person,x_m,y_m\n0,1,0,0\n9,1,1,0\n", "no crossing|shorter than a trip"),
    ],
)
def test_bad_tables_are_refused(text: str, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason) as caught:
        read_csv(source(text), ImportOptions())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no person with two samples"),
        ("1 2 3\n", "line 1: 3 columns"),
        ("1 1 0 0\n1 1 1 0\n", "person 1: time 0.04 s after 0.04 s"),
        ("1 1 0 x\n", "line 1: value='x': not a number"),
        ("\n\n1 1 inf 0\n", "line 3: value=inf: not finite"),
    ],
)
def test_bad_texts_are_refused(text: str, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        eth_ucy_tracks(text, 25.0)


KEYFRAMES = {
    "worlds": {"1": ["a", "b"], "7": ["b"]},
    "keyframes": {
        "a": {"duration_s": 4.0, "txyz": [[0.0, 1.0, 2.0, 0.0], [4.0, 3.0, 2.0, 0.0]]},
        "b": {"duration_s": 5.0, "txyz": [[0.0, 0.0, 5.0, 0.0], [3.0, 0.0, 8.0, 0.0]]},
    },
}


def test_dynabarn_keyframes() -> None:
    found = read_dynabarn(source(json.dumps(KEYFRAMES)), ImportOptions())
    assert [plain["name"] for plain in found.scenarios] == ["w-1", "w-7"]
    scenario = parse_scenario(json.dumps(found.scenarios[0]), "x")
    assert (scenario.start_m, scenario.goal_m) == ((11.0, 0.0), (-9.0, 0.0))
    first, second = scenario.obstacles
    assert (first.radius_m, first.loop) == (0.5, True)
    assert center_at(first, 9.0) == (1.5, 2.0)
    assert center_at(second, 4.0) == (0.0, 8.0)  # it stands until the animation repeats
    assert center_at(second, 6.0) == (0.0, 6.0)
    assert "splines" in found.lost[0]


PLUGIN = """
  gazebo::common::PoseAnimationPtr anim(
      new gazebo::common::PoseAnimation("obs_1", 4.00, true));
  key = anim->CreateKeyFrame(0.00);
  key->Translation(ignition::math::Vector3d(1.00, 2.00, 0));
  key->Rotation(ignition::math::Quaterniond(0, 0, 0));
  key = anim->CreateKeyFrame(4.00);
  key->Translation(ignition::math::Vector3d(3.00, 2.00, 0));
"""
MOVING = """<sdf version='1.6'><world name='w'><model name='obs_1'><pose>0 0 0 0 0 0</pose>
<link name='link'><collision name='c'><geometry><cylinder><radius>0.5</radius>
<length> 1 </length></cylinder></geometry></collision></link>
<plugin name='obs_1' filename='libobs_1.so'/></model></world></sdf>"""


def test_dynabarn_as_its_authors_publish_it(tmp_path: Path) -> None:
    (tmp_path / "plugins").mkdir()
    with pytest.raises(ConfigError, match="a plugin moves, without its source"):
        read_world(source(MOVING, tmp_path), ImportOptions())
    (tmp_path / "plugins/obs_1.cc").write_text(PLUGIN, encoding="utf-8")
    (plain,) = read_world(source(MOVING, tmp_path), ImportOptions()).scenarios
    assert plain["obstacles"] == [
        {"radius_m": 0.5, "trajectory": [[0.0, 1.0, 2.0], [4.0, 3.0, 2.0]], "loop": True}
    ]
    assert plain["start_m"] == [11.0, 0.0]
    (tmp_path / "plugins/obs_1.cc").write_text("// nothing", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"plugin obs_1\.cc: 0 keyframes"):
        read_world(source(MOVING, tmp_path), ImportOptions())


TOOLS = {
    "pedsim_agents": [
        {"name": "p", "pos": [1.0, 5.0, 0.0], "waypoints": [[4.0, 9.0, 0.3]], "vmax": 1.0},
        {"name": "q", "pos": [7.0, 7.0], "waypoints": []},
    ],
    "static_obstacles": [{"name": "table", "pos": [3, 3]}],
    "robot_position": [0.0, 0.0],
    "robot_goal": [9.0, 9.0],
    "map_path": "/maps/map1/map.yaml",
    "format": "arena-tools",
}
LATER = {
    "obstacles": {"dynamic": TOOLS["pedsim_agents"], "static": []},
    "robots": [{"start": [0, 0, 0], "goal": [9, 9, 0]}, {"start": [1, 1, 0], "goal": [2, 9, 0]}],
    "map": "map1",
}
FIRST = {
    "scenarios": [
        {
            "scene_name": "s",
            "robot": {"start_pos": [0, 0, 0], "goal_pos": [9, 9, 0]},
            "dynamic_obstacles": {
                "d": {
                    "obstacle_radius": 0.4, "linear_velocity": 0.5, "start_pos": [3, 5, 0],
                    "waypoints": [[2, 0, 0]], "is_waypoint_relative": True, "mode": "yoyo",
                }
            },
            "static_obstacles": {"c": {"radius": 0.7, "pos": [6, 2]}},
        }
    ]
}  # fmt: skip


def test_arena_scenarios() -> None:
    found = read_arena(source(json.dumps(TOOLS)), ImportOptions())
    (plain,) = found.scenarios
    assert (plain["start_m"], plain["goal_m"]) == ([0.0, 0.0], [9.0, 9.0])
    assert plain["obstacles"] == [
        {
            "radius_m": 0.3,
            "trajectory": [[0.0, 1.0, 5.0], [5.0, 4.0, 9.0], [10.0, 1.0, 5.0]],
            "loop": True,
        },
        {"center_m": [7.0, 7.0], "radius_m": 0.3},
    ]
    assert found.lost == [
        "the social forces of 2 agents: they walk from point to point",
        "1 x static model, which the file only names",
        "the map /maps/map1/map.yaml: name it as `map:` in the scenario",
    ]
    later = read_arena(source(json.dumps(LATER)), ImportOptions())
    assert later.scenarios[0]["obstacles"] == plain["obstacles"]
    assert later.lost[-1] == "1 further robots"
    (first,) = read_arena(source(json.dumps(FIRST)), ImportOptions()).scenarios
    assert first["obstacles"] == [
        {
            "radius_m": 0.4,
            "trajectory": [[0.0, 3.0, 5.0], [4.0, 5.0, 5.0], [8.0, 3.0, 5.0]],
            "loop": True,
        },
        {"center_m": [6.0, 2.0], "radius_m": 0.7},
    ]


IR_SIM = """
world: {height: 10, width: 10, obstacle_map: cave.png}
robot:
  - kinematics: {name: diff}
    shape: {name: circle, radius: 0.25}
    state: [1, 1, 0]
    goal: [9, 9, 0]
    vel_max: [1.5, 2.0]
    behavior: {name: dash}
    sensors:
      - {name: lidar2d, range_min: 0, range_max: 5, angle_range: 3.14159, number: 180}
      - {name: camera}
  - {state: [2, 2, 0], goal: [3, 3, 0], number: 2}
obstacle:
  - number: 2
    shape: [{name: circle, radius: 1.0}, {name: rectangle, length: 1.5, width: 1.2}]
    state: [[5, 5, 0], [4, 8, 1]]
  - shape: {name: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}
    state: [6, 1, 1.5707963267948966]
  - {shape: {name: linestring, vertices: [[5, 5], [4, 0], [1, 6]]}, state: [0, 0, 0]}
  - {kinematics: {name: omni}, behavior: {name: dash}, shape: {name: circle, radius: 0.3},
     state: [7, 2, 0], goal: [7, 8, 0], vel_max: [2, 2]}
  - {kinematics: {name: omni}, behavior: {name: rvo}, state: [8, 2, 0], goal: [8, 5, 0]}
  - {number: 10, distribution: {name: random}, shape: {name: circle}}
  - {shape: {name: map}, state: [1, 2, 0]}
"""


def test_ir_sim_worlds() -> None:
    found = read_ir_sim(source(IR_SIM), ImportOptions())
    (plain,) = found.scenarios
    assert plain["robot"] == {
        "drive": "differential", "max_speed_mps": 1.5, "max_turn_radps": 2.0,
        "lidar": {"beams": 180, "range_min_m": 0.0, "range_max_m": 5.0, "fov_rad": 3.1416},
    }  # fmt: skip
    assert (plain["start_m"], plain["robot_radius_m"]) == ([1.0, 1.0], 0.25)
    assert plain["obstacles"] == [
        {"center_m": [5.0, 5.0], "radius_m": 1.0},
        {"trajectory": [[0.0, 7.0, 2.0], [3.0, 7.0, 8.0]], "stays": True, "radius_m": 0.3},
        {"trajectory": [[0.0, 8.0, 2.0], [3.0, 8.0, 5.0]], "stays": True, "radius_m": 0.2},
    ]
    assert plain["boxes"] == [
        {"center_m": [4.0, 8.0], "size_m": [1.5, 1.2], "yaw_deg": round(math.degrees(1), 6)}
    ]
    assert plain["polygons_m"] == [[[6.0, 1.0], [6.0, 2.0], [5.0, 1.0]]]
    assert plain["segments_m"] == [[5.0, 5.0, 4.0, 0.0], [4.0, 0.0, 1.0, 6.0]]
    assert found.lost == [
        "1 x sensor camera",
        "2 x further robot",
        "1 x behaviour rvo of a moving obstacle: straight to its goal",
        "10 x obstacle with a distribution (random), drawn anew each time",
        "1 x obstacle of shape map",
        "1 x obstacle_map: name it as `map:` in the scenario",
    ]
    shapes = ("boxes", "polygons_m", "segments_m")
    circles = {key: value for key, value in plain.items() if key not in shapes}
    assert parse_scenario(json.dumps(circles), "x").robot.lidar.beams == 180


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no mapping"),
        ("[1, 2", "not YAML"),
        ("world: {}\n", "no robot in it"),
        ("robot: 3\n", "robot '3': not a mapping"),
        ("robot: {state: [.nan, 0], goal: [1, 1]}\n", "robot state=nan: not finite"),
        ("robot: {shape: {name: star}}\n", "robot shape 'star': not a circle"),
        ("robot: {}\nobstacle: {number: 1.0e+9}\n", "1000000000 obstacles: more than 5000"),
        ("robot: {}\nobstacle: {state: [1]}\n", "obstacle state='.1.': give a list of 2"),
    ],
)
def test_bad_ir_sim_worlds_are_refused(text: str, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        read_ir_sim(source(text), ImportOptions())


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        ([], "a list, not an object"),
        ({}, "no start and goal of a robot"),
        ({"scenarios": []}, "no scenario in it"),
        ({**TOOLS, "robot_goal": [1, None]}, "goal='None': not a number"),
        ({**TOOLS, "pedsim_agents": [3]}, "not a list of objects"),
        ({**TOOLS, "pedsim_agents": [{"pos": [0]}]}, "pos='.0.': give a list of 2"),
        ({**TOOLS, "pedsim_agents": [{"pos": [0, 0]}] * 5001}, "5002 obstacles: more than"),
    ],
)
def test_bad_arena_scenarios_are_refused(data: Any, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        read_arena(source(json.dumps(data)), ImportOptions())


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"worlds": {}}, "no worlds with keyframes"),
        ({"worlds": {"1": ["c"]}}, "world 1: no keyframes of c"),
        ({"worlds": {"1": 3}}, "world 1: no list of names"),
        ({"keyframes": {"a": {"txyz": [[0, 0, 0]]}}}, "1 keyframes; give two or more"),
        ({"keyframes": {"a": {"txyz": [[0, 0]]}}}, "keyframe of a=.*a list of 3"),
        ({"keyframes": {"a": 3}}, "keyframes of a: no list txyz"),
    ],
)
def test_bad_keyframes_are_refused(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        read_dynabarn(source(json.dumps({**KEYFRAMES, **changes})), ImportOptions())


def mutations(data: Any) -> Iterator[Any]:
    """The data with each of its values replaced by one of another kind, one at a time."""

    def paths(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
        if path:
            yield path
        if isinstance(value, dict | list):
            entries = value.items() if isinstance(value, dict) else enumerate(value)
            for key, inner in entries:
                yield from paths(inner, (*path, key))

    for path in paths(data):
        others: list[Any] = [None, "x", [], {"a": 1}, -1.0, float("nan")]
        for other in others:
            changed = copy.deepcopy(data)
            holder = changed
            for key in path[:-1]:
                holder = holder[key]
            holder[path[-1]] = other
            yield changed


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("dynabarn.json", KEYFRAMES),
        ("tools.json", TOOLS),
        ("later.json", LATER),
        ("first.json", FIRST),
        ("world.yaml", yaml.safe_load(IR_SIM)),
    ],
)
def test_whatever_a_file_holds_it_is_imported_or_refused(
    name: str, data: Any, tmp_path: Path
) -> None:
    path, refused, total = tmp_path / name, 0, 0
    for changed in islice(mutations(data), 0, None, 2 if name.endswith("json") else 7):
        path.write_text(json.dumps(changed), encoding="utf-8")  # JSON is YAML too
        (result,) = import_files([path], ImportOptions())
        assert bool(result.error) != bool(result.texts)
        assert "\n" not in result.error
        refused, total = refused + bool(result.error), total + 1
    assert 0 < refused < total


def test_content_tells_the_json_formats_apart(tmp_path: Path) -> None:
    for name, data in (("a.json", KEYFRAMES), ("b.json", TOOLS), ("c.json", "no")):
        (tmp_path / name).write_text(json.dumps(data), encoding="utf-8")
    (tmp_path / "d.json").write_text("{", encoding="utf-8")
    results = list(import_files(sorted(tmp_path.iterdir()), ImportOptions()))
    assert [list(result.texts) for result in results] == [["a-1", "a-7"], ["b"], [], []]
    assert "a str, not an object" in results[2].error
    assert "not JSON" in results[3].error
