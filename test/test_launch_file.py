# SPDX-License-Identifier: Apache-2.0
"""simulate.launch.py: what it tells the nodes, and that `launch` can read it."""

import ast
import importlib.util
from importlib import import_module
from pathlib import Path

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.launcher.by_launch import ARGUMENTS, told_by_launch
from mfba_planner.run_config import NODES, RunConfig, node_parameters
from mfba_planner.scenarios import load_scenario

FILE = Path(__file__).parents[1] / "launch" / "simulate.launch.py"


def given(**changes: str) -> dict[str, str]:
    return {name: argument.default for name, argument in ARGUMENTS.items()} | changes


def test_defaults_are_case_study_1_in_real_time_and_unrecorded() -> None:
    config = RunConfig(scenario=load_scenario("case1"), real_time=True)
    expected = node_parameters(config, NODES)
    expected["world_sim"]["start_paused"] = False
    assert told_by_launch(given()) == expected


def test_arguments_reach_the_nodes() -> None:
    told = told_by_launch(
        given(
            scenario="case2",
            seed="5",
            algorithm="ba",
            reading="fig1",
            real_time="false",
            record="true",
            bag="here",
        )
    )
    assert next(iter(told)) == "recorder"
    assert (told["recorder"]["output"], told["recorder"]["nodes"]) == ("here", ",".join(NODES))
    assert told["planner"]["wait_for"] == ",".join((*NODES, "recorder"))
    assert told["planner"]["seed"] == 5
    assert (told["planner"]["bat.algorithm"], told["planner"]["swarm"]) == ("ba", "persistent")
    assert (told["world_sim"]["lockstep"], "case2" in told["world_sim"]["scenario"]) == (
        True,
        True,
    )


@pytest.mark.parametrize(
    ("name", "value", "line"),
    [
        ("seed", "x", "seed:=x: not a number; give one"),
        ("speed_factor", "0", "speed_factor=0.0: out of range"),
        ("scenario", "case9", "'case9': no such scenario"),
        ("algorithm", "pso", "algorithm='pso': unknown; choose one of"),
        ("reading", "fig9", "'fig9': unknown planner reading"),
    ],
)
def test_bad_arguments_are_one_line(name: str, value: str, line: str) -> None:
    with pytest.raises(ConfigError) as caught:
        told_by_launch(given(**{name: value}))
    assert str(caught.value).startswith(line)


def test_every_argument_is_described_and_its_default_is_a_choice() -> None:
    for name, argument in ARGUMENTS.items():
        assert argument.description, name
        assert not argument.choices or argument.default in argument.choices, name


def test_launch_file_is_what_launch_expects() -> None:
    """Read by launch itself where it is installed (it is no wheel), otherwise by its syntax."""
    if importlib.util.find_spec("launch_ros") is not None:
        sources = import_module("launch.launch_description_sources")
        description = sources.get_launch_description_from_python_launch_file(str(FILE))
        assert [a.name for a in description.get_launch_arguments()] == list(ARGUMENTS)
        return
    tree = ast.parse(FILE.read_text(encoding="utf-8"))
    compile(tree, str(FILE), "exec")
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert functions["generate_launch_description"].args.args == []
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert {"ARGUMENTS", "told_by_launch", "DeclareLaunchArgument", "Node"} <= used
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mfba_planner"):
            for alias in node.names:
                assert hasattr(import_module(node.module or ""), alias.name)
