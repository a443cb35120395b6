# SPDX-License-Identifier: Apache-2.0
"""`trajectory` in scenario files: inline or a CSV file beside it, and what is refused."""

import json
from pathlib import Path

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.suites.scenario_suite import read_scenario_files
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_dict, scenario_to_json
from mfba_planner.scenarios.trajectory_file import read_trajectory
from mfba_planner.scenarios.yaml_schema import schema
from mfba_planner.simulation.recorded_motion import MOST_KNOTS

WORLD = "name: w\nstart_m: [0, 0]\ngoal_m: [9, 0]\nobstacles:\n  - {{radius_m: 0.3, {}}}\n"
INLINE = WORLD.format("trajectory: [[0, 3, 4], [1.5, 3, 2]], loop: true, vanishes_s: 9")


def refusal(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_scenario(text, "w.yaml")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_file_beside_the_scenario_is_read_from_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data/walker.csv").write_text("t_s,x_m,y_m\n0,3,4\n\n1.5,3,2\n", encoding="utf-8")
    path = tmp_path / "w.yaml"
    rest = "loop: true, vanishes_s: 9"
    path.write_text(WORLD.format(f"trajectory: data/walker.csv, {rest}"), encoding="utf-8")
    assert load_scenario(str(path)) == parse_scenario(INLINE, "x")
    monkeypatch.chdir(tmp_path / "data")
    assert load_scenario("../w.yaml") == parse_scenario(INLINE, "x")
    absolute = WORLD.format(f"trajectory: {tmp_path}/data/walker.csv, {rest}")
    assert parse_scenario(absolute, "x") == parse_scenario(INLINE, "x")
    # What nodes, bags and sweeps get holds the points.
    text = scenario_to_json(load_scenario("../w.yaml"))
    assert json.loads(text)["obstacles"][0]["trajectory"] == [[0.0, 3.0, 4.0], [1.5, 3.0, 2.0]]
    scenarios, _ = read_scenario_files(["../w.yaml"])
    (tmp_path / "data/walker.csv").unlink()
    assert scenarios.suite().world(0) == parse_scenario(INLINE, "x")


def test_columns_without_a_header_and_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("\ufeff-1, 0, 0\n2, 1e1, -3\n", encoding="utf-8")
    assert read_trajectory(path) == [[-1.0, 0.0, 0.0], [2.0, 10.0, -3.0]]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "empty; give lines of t_s, x_m, y_m"),
        (b"t_s,x_m,y_m\n", "empty"),
        (b"x,y\n", "line 1: 'x, y': not three numbers"),
        (b"0,1,2\n1,2\n", "line 2: '1, 2': not three numbers"),
        (b"0,1,2\n1,2,3,4\n", "line 2: '1, 2, 3, 4': not three numbers"),
        (b"\xff\xfe\x00", "not a text file"),
        (b"0,1,2\n" * (MOST_KNOTS + 1), f"more than {MOST_KNOTS} points"),
    ],
)
def test_files_that_are_no_trajectory(content: bytes, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    message = refusal(WORLD.format(f"trajectory: {path}"))
    assert message.startswith("w.yaml: ")
    assert str(path) in message
    assert reason in message


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("trajectory: none.csv", "trajectory none.csv: No such file or directory; give lines of"),
        ("trajectory: [[0, 1, 2]]", "obstacle 1 trajectory: a single point; give two or more"),
        ("trajectory: [[1, 1, 2], [0, 2, 2]]", "t=0 does not come after 1; sort the points"),
        ("trajectory: [[0, .nan, 2], [1, 2, 2]]", "trajectory.1.2=nan: refused; give a finite"),
        ("trajectory: [[0, 1], [1, 2, 2]]", "obstacles.1.trajectory.1.3: missing"),
        ("trajectory: 3", "obstacles.1.trajectory=3: refused; give a list"),
        ("trajectory: []", "obstacles.1.center_m: missing"),
        ("center_m: [3, 3], loop: true", "obstacle 1 loop: without a trajectory"),
        ("center_m: [3, 3], appears_s: -1", "obstacles.1.appears_s=-1: refused"),
        ("center_m: [3, 3], vanishes_s: 0", "obstacles.1.vanishes_s=0: refused"),
        ("trajectry: [[0, 1, 2], [1, 2, 2]]", "did you mean 'trajectory'?"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(keys: str, message: str) -> None:
    assert message in refusal(WORLD.format(keys))


def test_keys_that_are_not_used_are_not_written() -> None:
    scenario = parse_scenario(WORLD.format("center_m: [3, 3]"), "x")
    assert set(scenario_to_dict(scenario)["obstacles"][0]) == {
        "center_m", "radius_m", "speed_mps", "heading_rad",
    }  # fmt: skip
    moving = parse_scenario(INLINE, "x")
    assert load_scenario(scenario_to_json(moving)) == moving
    (plain,) = scenario_to_dict(moving)["obstacles"]
    assert {"trajectory", "loop", "vanishes_s"} <= set(plain)
    assert not {"stays", "appears_s", "turns"} & set(plain)


def test_every_key_has_a_meaning() -> None:
    keys = schema()["$defs"]["_Obstacle"]["properties"]
    for name in ("trajectory", "loop", "stays", "appears_s", "vanishes_s"):
        assert keys[name]["description"]
