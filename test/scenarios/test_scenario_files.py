# SPDX-License-Identifier: Apache-2.0
"""Scenario files: accepted and refused input, error messages, and the way back to JSON."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_dict, scenario_to_json
from mfba_planner.scenarios.yaml_schema import checked
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn, Walls
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

EXAMPLE = "compare config/scenarios/case1.yaml"
TASK = "name: x\nstart_m: [0, 0]\ngoal_m: [5, 5]\n"


def refusal(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_scenario(text, "my.yaml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("my.yaml")
    return message.removeprefix("my.yaml")


def with_obstacle(changes: str) -> str:
    return f"{TASK}obstacles: [{{{changes}}}]"


# --- accepted ---------------------------------------------------------------------------------


def test_case_study_1_is_table_4() -> None:
    scenario = load_scenario("case1")
    assert (scenario.start_m, scenario.goal_m) == ((0.0, 0.0), (12.0, 12.0))
    assert scenario.robot_radius_m == 0.3
    assert [
        (o.center_m, o.radius_m, o.speed_mps, round(math.degrees(o.heading_rad), 9))
        for o in scenario.obstacles
    ] == [
        ((1.0, 4.5), 0.3, 0.3, 0.0),
        ((10.5, 6.0), 0.3, 0.2, 180.0),
        ((6.0, 12.0), 0.3, 0.15, 270.0),
    ]


def test_case_study_2_is_table_6() -> None:
    assert [
        (o.center_m, o.radius_m, o.speed_mps, round(math.degrees(o.heading_rad), 9))
        for o in load_scenario("case2").obstacles
    ] == [
        ((4.0, 2.0), 0.3, 0.3, 111.8),
        ((3.0, 7.0), 0.3, 0.2, 315.0),
        ((9.0, 4.0), 0.3, 0.2, 126.8),
        ((7.0, 9.0), 0.3, 0.25, 315.0),
        ((11.2, 7.0), 0.3, 0.22, 150.0),
    ]


@pytest.mark.parametrize("name", ["case1", "case2", "empty", "kidnapped", "walled"])
def test_every_shipped_scenario_has_its_name_and_can_be_solved(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert evaluate(run(scenario)).success


def test_the_shipped_place_is_made_of_segments_boxes_and_a_polygon() -> None:
    """The paper's planner does not pass its door, so it is not among those above."""
    scenario = load_scenario("rooms")
    assert scenario.name == "rooms"
    assert len(scenario.segments_m) == 6 + 2 * 4 + 3
    assert load_scenario(scenario_to_json(scenario)) == scenario


def test_whole_numbers_are_numbers() -> None:
    scenario = parse_scenario(with_obstacle("center_m: [1, 4], radius_m: 1, speed_mps: 2"), "x")
    assert scenario.start_m == (0.0, 0.0)
    assert scenario.obstacles == (Obstacle(center_m=(1.0, 4.0), radius_m=1.0, speed_mps=2.0),)
    assert {type(v) for v in scenario.start_m + scenario.obstacles[0].center_m} == {float}


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 1e-3), ("+1E-3", 1e-3), ("1.5e+2", 150.0), (".5e1", 5.0), ("2.", 2.0), ("7", 7.0)],
)
def test_numbers_as_people_write_them(text: str, value: float) -> None:
    assert parse_scenario(f"{TASK}time_limit_s: {text}", "x").time_limit_s == value


def test_missing_keys_have_the_defaults_of_the_dataclass() -> None:
    assert parse_scenario(TASK, "x") == Scenario(name="x", start_m=(0.0, 0.0), goal_m=(5.0, 5.0))


def test_everything_given() -> None:
    text = """
        {name: all 1_2.3-4+5, description: "two\\nlines", start_m: [0.5, 1], goal_m: [5, 5],
        robot_radius_m: 0.2, time_limit_s: 30, walls: {lower_m: [-1, 0], upper_m: [9, 8]},
        obstacles: [{center_m: [4, 4], radius_m: 0.5, speed_mps: 0.1, heading_rad: 1.5},
                    {center_m: [7, 4], radius_m: 0.5, speed_mps: 0.1, heading_deg: -90}]}
    """
    assert load_scenario(text) == Scenario(
        name="all 1_2.3-4+5",
        description="two\nlines",
        start_m=(0.5, 1.0),
        goal_m=(5.0, 5.0),
        robot_radius_m=0.2,
        time_limit_s=30.0,
        walls=Walls(lower_m=(-1.0, 0.0), upper_m=(9.0, 8.0)),
        obstacles=(
            Obstacle(center_m=(4.0, 4.0), radius_m=0.5, speed_mps=0.1, heading_rad=1.5),
            Obstacle(
                center_m=(7.0, 4.0), radius_m=0.5, speed_mps=0.1, heading_rad=math.radians(-90.0)
            ),
        ),
    )


def test_no_obstacles_are_allowed() -> None:
    assert parse_scenario(f"{TASK}obstacles: []", "x").obstacles == ()
    assert load_scenario("empty").obstacles == ()


def test_a_goal_inside_an_obstacle_at_rest_is_allowed_and_never_reached() -> None:
    text = with_obstacle("center_m: [5, 5], radius_m: 0.5") + "\ntime_limit_s: 25"
    episode = run(parse_scenario(text, "x"))
    assert episode.outcome is Outcome.TIME_LIMIT
    assert evaluate(episode).collisions == 0


# --- where a scenario comes from --------------------------------------------------------------


def test_files_names_and_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    mine = parse_scenario(TASK, "x")
    for name in ("mine.yaml", "mine.yml", "mine", "mine.json", "{.yaml"):
        Path(name).write_text(TASK)
    for source in ("mine.yaml", "mine.yml", "mine", str(tmp_path / "mine"), "./{.yaml"):
        assert load_scenario(source) == mine
    Path("mine.json").write_text(scenario_to_json(mine))
    assert load_scenario("mine.json") == mine
    assert load_scenario(scenario_to_json(mine)) == mine
    assert load_scenario(f"  \n{{{', '.join(TASK.split(chr(10)))}}}") == mine


def test_shipped_names_win_over_files_of_the_same_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = load_scenario("case1")
    monkeypatch.chdir(tmp_path)
    Path("case1").mkdir()
    Path("case2").write_text(TASK)
    assert load_scenario("case1") == shipped
    assert len(load_scenario("case2").obstacles) == 5


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("cas1", "'cas1': no such scenario; did you mean 'case1'? (or give a .yaml file)"),
        (
            "",
            "'': no such scenario; known: case1, case2, empty, kidnapped, rooms, swap, walled "
            "(or give a .yaml file)",
        ),
        (
            ".",
            "'.': no such scenario; known: case1, case2, empty, kidnapped, rooms, swap, walled "
            "(or give a .yaml file)",
        ),
        ("nope.yaml", "nope.yaml: No such file or directory; give a readable scenario .yaml"),
        ("folder.yaml", "folder.yaml: Is a directory; give a readable scenario .yaml"),
        ("picture.yml", "picture.yml: not a text file; give a readable scenario .yaml"),
        ("empty.yaml", f"empty.yaml: empty; {EXAMPLE}"),
        ("a\x00.json", "a\x00.json: not a text file; give a readable scenario .yaml"),
    ],
)
def test_sources_that_cannot_be_found_or_read(
    source: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder.yaml").mkdir()
    Path("picture.yml").write_bytes(b"\x89PNG\xff")
    Path("empty.yaml").touch()
    with pytest.raises(ConfigError) as caught:
        load_scenario(source)
    assert str(caught.value) == message


def test_a_text_too_long_for_a_name_is_still_one_line() -> None:
    for source in ("x" * 5000, "x" * 5000 + ".yaml", "name: x\nstart_m: [0, 0]"):
        with pytest.raises(ConfigError) as caught:
            load_scenario(source)
        assert "\n" not in str(caught.value)


# --- refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["", "  \n\n", "# nothing yet\n", "---\n", "null"])
def test_empty(text: str) -> None:
    assert refusal(text) == f": empty; {EXAMPLE}"


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("- 1\n- 2", "list"),
        ("hello", "str"),
        ("5", "int"),
        ("!!set {a, b}", "set"),
        ("[]", "list"),
    ],
)
def test_not_a_mapping(text: str, kind: str) -> None:
    assert refusal(text) == f": a {kind}, not a mapping; {EXAMPLE}"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("{", " line 1: not YAML (expected the node content, but found '<stream end>')"),
        ("name: x\n  start: y", " line 2: not YAML (mapping values are not allowed here)"),
        ("a: *b", " line 1: not YAML (found undefined alias 'b')"),
        ("a: 1\n---\nb: 2", " line 2: not YAML (but found another document)"),
        ("[1, 2]: 3", " line 1: not YAML (found unhashable key)"),
        ("{1: 2}: 3", " line 1: not YAML (found unhashable key)"),
        (TASK + "name: y", " line 4: not YAML ('name' given twice)"),
        (with_obstacle("radius_m: 1, radius_m: 2"), " line 4: not YAML ('radius_m' given twice)"),
        ("a: !!python/object:os.system x", " line 1: not YAML (could not determine"),
        ("a: \x07", ": not YAML (unreadable characters)"),
        ("a: 2020-99-99", ": not YAML (unreadable value)"),
        ("a: !!int abc", ": not YAML (unreadable value)"),
        ("a: !!float ''", ": not YAML (unreadable value)"),
        ("a: !!timestamp 5", ": not YAML (unreadable value)"),
        ("[" * 5000, ": not YAML (unreadable value)"),
        ('{"a":' * 5000, ": not YAML (unreadable value)"),
        ("time_limit_s: 1" + "0" * 5000, ": not YAML (unreadable value)"),
    ],
    ids=range(17),
)  # fmt: skip
def test_not_yaml(text: str, problem: str) -> None:
    message = refusal(text)
    assert message.startswith(problem)
    assert message.endswith(f"; {EXAMPLE}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TASK + "goal: 3", "goal: unknown key; did you mean 'goal_m'?"),
        (TASK + "zzzz: 3", "zzzz: unknown key; known: boxes, description, goal_m, "
                           "kidnappings, map, name, obstacles, polygons_m, robot, "
                           "robot_radius_m, robots, segments_m, start_m, time_limit_s, walls"),
        # the misspelt key is named, not the one missing because of it
        ("name: x\nstart_m: [0, 0]\ngaol_m: [1, 1]",
         "gaol_m: unknown key; did you mean 'goal_m'?"),
        (with_obstacle("center_m: [4, 4], radius_m: 0.3, speed: 1"),
         "obstacles.1.speed: unknown key; did you mean 'speed_mps'?"),
        (with_obstacle("center_m: [4, 4], raduis_m: 0.3"),
         "obstacles.1.raduis_m: unknown key; did you mean 'radius_m'?"),
        (TASK + "walls: {lower_m: [0, 0], uper_m: [1, 1]}",
         "walls.uper_m: unknown key; did you mean 'upper_m'?"),
        (TASK + "1: 2", f"key 1: not a word; remove it ({EXAMPLE})"),
        (TASK + "? null\n: 2", f"key None: not a word; remove it ({EXAMPLE})"),
        ("start_m: [0, 0]\ngoal_m: [1, 1]", f"name: missing; add it ({EXAMPLE})"),
        (with_obstacle("radius_m: 1"), f"obstacles.1.center_m: missing; add it ({EXAMPLE})"),
        (with_obstacle("center_m: [4], radius_m: 1"),
         f"obstacles.1.center_m.2: missing; add it ({EXAMPLE})"),
    ],
)  # fmt: skip
def test_unknown_misspelt_and_missing_keys(text: str, message: str) -> None:
    assert refusal(text) == f": {message}"


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (".nan", "nan: refused; give a finite number"),
        (".inf", "inf: refused; give a finite number"),
        ("-.inf", "-inf: refused; give a finite number"),
        ("1e999", "inf: refused; give a finite number"),
        ("'0.3'", "'0.3': refused; give a number"),
        ("wide", "'wide': refused; give a number"),
        ("true", "True: refused; give a number"),
        ("null", "None: refused; give a number"),
        ("[1]", "[1]: refused; give a number"),
        ("1" + "0" * 400, "1" + "0" * 56 + "...: refused; give a number"),
        ("x" * 200, "'" + "x" * 56 + "...: refused; give a number"),
    ],
    ids=range(11),
)
def test_what_is_not_a_finite_number(value: str, message: str) -> None:
    for key in ("time_limit_s", "robot_radius_m"):
        assert refusal(f"{TASK}{key}: {value}") == f": {key}={message}"
    for key, rest in (("radius_m", ""), ("speed_mps", "radius_m: 1, ")):
        text = with_obstacle(f"center_m: [4, 4], {rest}{key}: {value}")
        assert refusal(text) == f": obstacles.1.{key}={message}"
    text = TASK.replace("[5, 5]", f"[5, {value}]")
    assert refusal(text) == f": goal_m.2={message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (with_obstacle("center_m: [4, 4], radius_m: -0.3"),
         "obstacles.1.radius_m=-0.3: refused; give a number greater than 0"),
        (with_obstacle("center_m: [4, 4], radius_m: 0"),
         "obstacles.1.radius_m=0: refused; give a number greater than 0"),
        (with_obstacle("center_m: [4, 4], radius_m: 0.3, speed_mps: -1"),
         "obstacles.1.speed_mps=-1: refused; give a number greater than or equal to 0"),
        (TASK + "robot_radius_m: -0.1",
         "robot_radius_m=-0.1: refused; give a number greater than 0"),
        (TASK + "time_limit_s: 0", "time_limit_s=0: refused; give a number greater than 0"),
        (TASK + "time_limit_s: 1000000.5",
         "time_limit_s=1000000.5: refused; give a number less than or equal to 1000000"),
        (with_obstacle("center_m: [4, -2e6], radius_m: 1"),
         "obstacles.1.center_m.2=-2000000.0: refused; "
         "give a number greater than or equal to -1000000"),
        (with_obstacle("center_m: [4, 4, 4], radius_m: 1"),
         "obstacles.1.center_m=[4, 4, 4]: refused; give two numbers, [x, y]"),
        (TASK.replace("[5, 5]", "5"), "goal_m=5: refused; give two numbers, [x, y]"),
        (TASK + "walls: 3", f"walls=3: refused; give a mapping ({EXAMPLE})"),
        (TASK + "obstacles: [3]", f"obstacles.1=3: refused; give a mapping ({EXAMPLE})"),
        (TASK + "obstacles: 3", "obstacles=3: refused; give a list ([] for none)"),
        (TASK + "obstacles:", "obstacles=None: refused; give a list ([] for none)"),
        (TASK.replace("x", "7"), "name=7: refused; give a text"),
        (TASK.replace("x", "''"),
         "name='': refused; give a name of letters, digits, spaces and _ . + -"),
        (TASK.replace("x", "../x"),
         "name='../x': refused; give a name of letters, digits, spaces and _ . + -"),
        (TASK.replace("x", "x" * 101),
         "name='" + "x" * 56 + "...: refused; give at most 100 characters"),
        (TASK + "description: [1]", "description=[1]: refused; give a text"),
    ],
)  # fmt: skip
def test_values_of_the_wrong_kind_or_range(text: str, message: str) -> None:
    assert refusal(text) == f": {message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: x\nstart_m: [1, 2]\ngoal_m: [1, 2]",
         "goal_m=[1.0, 2.0]: equal to start_m; move one of them"),
        (with_obstacle("center_m: [0.5, 0], radius_m: 0.4"),
         "start_m=[0.0, 0.0]: the robot starts 0.2 m inside obstacle 1 (radii added); "
         "move start_m or the obstacle"),
        (with_obstacle("center_m: [3, 4], radius_m: 1")
         + "\nwalls: {lower_m: [0, 0], upper_m: [9, 4.5]}",
         "obstacle 1 center_m=[3.0, 4.0]: not inside the walls; move it or widen the walls"),
        (TASK + "walls: {lower_m: [0, 3], upper_m: [9, 3]}",
         "walls [0.0, 3.0] to [9.0, 3.0]: give lower_m below upper_m on both axes"),
        (TASK + "walls: {lower_m: [2, 3], upper_m: [1, 4]}",
         "walls [2.0, 3.0] to [1.0, 4.0]: give lower_m below upper_m on both axes"),
        (with_obstacle("center_m: [3, 4], radius_m: 1, heading_deg: 90, heading_rad: 1"),
         "heading_deg=90: heading_rad=1 is given as well; keep one of them"),
    ],
)  # fmt: skip
def test_invalid_tasks(text: str, message: str) -> None:
    assert refusal(text) == f": {message}"


def test_messages_name_an_inline_scenario() -> None:
    with pytest.raises(ConfigError, match=r"^inline scenario: zzzz: unknown key; known: "):
        load_scenario('{"zzzz": 1}')
    with pytest.raises(ConfigError, match=r"^inline scenario: start_m.1=nan: refused; give a fin"):
        load_scenario('{"name": "x", "start_m": [NaN, 0], "goal_m": [1, 1]}')


@given(st.text())
def test_any_text_raises_config_error_only(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_scenario(text, "my.yaml")
    assert "\n" not in str(caught.value)


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(
                    ["name", "start_m", "goal_m", "obstacles", "walls", "center_m", "?"]
                ),
                inner,
                max_size=4,
            )
        ),
        max_leaves=8,
    )
)
def test_any_data_raises_config_error_only(data: Any) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_scenario(json.dumps(data), "my.yaml")
    assert "\n" not in str(caught.value)


# --- back to JSON -----------------------------------------------------------------------------

NUMBERS = st.floats(-1e6, 1e6)
POSITIVE = st.floats(0.0, 1e6, exclude_min=True)
POINTS = st.tuples(NUMBERS, NUMBERS)
TURNS = st.lists(
    st.builds(Turn, at_s=POSITIVE, speed_mps=st.floats(0.0, 1e6), heading_rad=NUMBERS),
    max_size=3,
    unique_by=lambda turn: turn.at_s,
).map(lambda turns: tuple(sorted(turns, key=lambda turn: turn.at_s)))


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    start, goal = draw(POINTS), draw(POINTS)
    assume(start != goal)
    obstacles = draw(
        st.lists(
            st.builds(
                Obstacle,
                center_m=POINTS,
                radius_m=POSITIVE,
                speed_mps=st.floats(0.0, 1e6),
                heading_rad=NUMBERS,
                turns=TURNS,
            ),
            max_size=3,
        )
    )
    walls = draw(st.none() | st.just(Walls(lower_m=(-3e5, -4e5), upper_m=(5e5, 1e6))))
    try:
        return Scenario(
            name=draw(st.from_regex(r"\A[A-Za-z0-9_é][A-Za-z0-9_ .+ß-]{0,20}\Z")),
            start_m=start,
            goal_m=goal,
            robot_radius_m=draw(POSITIVE),
            obstacles=tuple(obstacles),
            walls=walls,
            time_limit_s=draw(POSITIVE),
            description=draw(st.text()),
        )
    except ConfigError:
        assume(False)
        raise


FIDDLY = Scenario(
    name="é 1.2",
    start_m=(5e-324, -0.0),
    goal_m=(1e-7, 0.1),
    robot_radius_m=1e-7,
    time_limit_s=123456.789e-9,
    obstacles=(Obstacle(center_m=(1e6, 1.0 / 3.0), radius_m=1e-7, heading_rad=2.0 / 3.0),),
    description="\u2028 \x7f \U0001f987 {a: b} # \\ \" '",
)


@given(scenarios())
@example(FIDDLY)
def test_json_and_back_is_the_same_scenario(scenario: Scenario) -> None:
    text = scenario_to_json(scenario)
    assert "\n" not in text
    again = load_scenario(text)
    assert again == scenario
    assert scenario_to_json(again) == text
    assert json.loads(text) == scenario_to_dict(scenario)


def outcome(parse: Callable[[dict[str, Any]], Scenario], data: dict[str, Any]) -> object:
    """The result of plain data: a scenario, or an error message."""
    try:
        return parse(data)
    except ConfigError as error:
        return str(error).removeprefix("x: ")


@given(scenarios())
def test_yaml_schema_accepts_what_programs_write(scenario: Scenario) -> None:
    assert outcome(checked, scenario_to_dict(scenario)) == scenario


ODD = st.sampled_from(
    [0.0, -0.0, -1.0, 2e6, -2e6, math.nan, math.inf, 1, True, None, "x", "a b", "\n", "x\n", "é"]
    + [[], {}, [1.0], [1.0, 2.0], [1.0, 2.0, 3.0], [[0.5, 0.5]], {"at_s": 1.0}, "x" * 101]
)


@given(scenarios(), ODD, st.data())
def test_unusual_data_gives_the_same_result_as_yaml_schema(
    scenario: Scenario, odd: Any, data: st.DataObject
) -> None:
    plain = scenario_to_dict(scenario)
    node: Any = plain
    while True:
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        key = data.draw(st.sampled_from(keys + ["another"] * isinstance(node, dict)))
        deeper = key != "another" and isinstance(node[key], dict | list) and node[key]
        if not deeper or data.draw(st.booleans()):
            break
        node = node[key]
    if key != "another" and data.draw(st.booleans()):
        del node[key]
    else:
        node[key] = odd
    text = json.dumps(plain)
    assert outcome(lambda _: parse_scenario(text, "x"), plain) == outcome(checked, plain)


def test_pydantic_and_yaml_are_not_imported_for_what_programs_write() -> None:
    text = scenario_to_json(load_scenario("case2"))
    code = (
        "import sys\nfrom mfba_planner.scenarios.scenario_files import load_scenario\n"
        "load_scenario(sys.argv[1])\nassert not {'pydantic', 'yaml'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code, text], check=True)


@given(st.floats(-720.0, 720.0))
def test_a_heading_keeps_its_last_bit(degrees: float) -> None:
    text = with_obstacle(f"center_m: [4, 4], radius_m: 1, heading_deg: {degrees!r}")
    scenario = parse_scenario(text, "x")
    assert scenario.obstacles[0].heading_rad == math.radians(degrees)
    assert load_scenario(scenario_to_json(scenario)) == scenario


@pytest.mark.parametrize("name", ["case1", "case2", "empty", "kidnapped", "walled"])
def test_a_run_from_json_is_the_same_run(name: str) -> None:
    scenario = load_scenario(name)
    again = load_scenario(scenario_to_json(scenario))
    assert again == scenario
    assert run(again, seed=2) == run(scenario, seed=2)


def test_plain_data_is_plain() -> None:
    data = scenario_to_dict(load_scenario("walled"))
    assert data["walls"] == {"lower_m": [0.0, 0.0], "upper_m": [12.0, 12.0]}
    assert data["obstacles"][0]["heading_rad"] == math.radians(80.0)
    assert "heading_deg" not in data["obstacles"][0]
    assert "turns" not in data["obstacles"][0]


# --- turns ------------------------------------------------------------------------------------

WITH_TURNS = """name: x
start_m: [0, 0]
goal_m: [5, 5]
obstacles:
  - center_m: [3, 3]
    radius_m: 0.3
    speed_mps: 0.2
    turns:
      - {at_s: 2, speed_mps: 0.5, heading_deg: 90}
      - {at_s: 4.5, speed_mps: 0}
      - {at_s: 6, speed_mps: 1, heading_rad: 0.5}
"""


def test_obstacles_may_turn() -> None:
    scenario = parse_scenario(WITH_TURNS, "x")
    assert scenario.obstacles[0].turns == (
        Turn(at_s=2.0, speed_mps=0.5, heading_rad=math.pi / 2.0),
        Turn(at_s=4.5, speed_mps=0.0, heading_rad=0.0),
        Turn(at_s=6.0, speed_mps=1.0, heading_rad=0.5),
    )
    assert load_scenario(scenario_to_json(scenario)) == scenario
    assert len(scenario_to_dict(scenario)["obstacles"][0]["turns"]) == 3


@pytest.mark.parametrize(
    ("turn", "message"),
    [
        ("at_s: 1", ": obstacles.1.turns.1.speed_mps: missing; add it"),
        ("speed_mps: 1", ": obstacles.1.turns.1.at_s: missing; add it"),
        ("at_s: -1, speed_mps: 1", ": obstacles.1.turns.1.at_s=-1: refused; give a number"),
        ("at_s: 1, speed_mps: -1", ": obstacles.1.turns.1.speed_mps=-1: refused; give a number"),
        (
            "at_s: 1, speed_mps: 1, heading: 3",
            ": obstacles.1.turns.1.heading: unknown key; did you mean 'heading_",
        ),
        (
            "at_s: 1, speed_mps: 1, heading_deg: 3, heading_rad: 1",
            ": heading_deg=3: heading_rad=1 is given as well; keep one of them",
        ),
        (
            "at_s: 1, speed_mps: 1}, {at_s: 1, speed_mps: 2",
            ": obstacle 1 turns: at_s=1 does not come after 1; sort the turns by time",
        ),
    ],
)
def test_invalid_turns_are_refused(turn: str, message: str) -> None:
    found = refusal(with_obstacle(f"center_m: [4, 4], radius_m: 1, turns: [{{{turn}}}]"))
    assert found.startswith(message)
