# SPDX-License-Identifier: Apache-2.0
"""The launch files: the node parameters they give, and that `launch` can read them."""

import importlib.util
import re
import xml.etree.ElementTree as ElementTree
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import reference
import yaml
from launch_standin import declared, launched
from project import ROOT
from ros_graph import Graph

from mfba_planner.core.errors import ConfigError, InputError
from mfba_planner.core.option_specs import flatten
from mfba_planner.launcher.robot_launch_description import (
    PLANNER_ARGUMENTS,
    REPLAY_ARGUMENTS,
    replay_nodes,
    robot_nodes,
)
from mfba_planner.launcher.simulate_launch_description import ARGUMENTS, launch_parameters
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.ros.node_settings import Source
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.replaying.replay_arguments import parse
from mfba_planner.scenarios.run_config import (
    NODES,
    OF_ROBOT,
    RunConfig,
    node_parameters,
    with_perception,
)
from mfba_planner.scenarios.scenario_files import load_scenario

LAUNCH = ROOT / "launch"


def given(**changes: str) -> dict[str, str]:
    return {name: argument.default for name, argument in ARGUMENTS.items()} | changes


def test_defaults_are_case_study_1_in_real_time_and_unrecorded() -> None:
    usual = preset(PlannerParams(method=Method.PREDICTIVE))
    scenario, usual = with_perception(load_scenario("case1"), usual)
    config = RunConfig(scenario=scenario, planner=usual, real_time=True)
    expected = node_parameters(config, NODES)
    expected["world_sim"]["start_paused"] = False
    assert launch_parameters(given()) == expected


@pytest.mark.parametrize(
    ("changes", "method", "iterations"),
    [
        ({"planner": "paper"}, "paper", 5),
        ({"algorithm": "ba"}, "paper", 5),
        ({"reading": "fig1"}, "paper", 1),
        ({"planner": "predictive", "algorithm": "ba"}, "predictive", 1),
    ],
)
def test_options_of_algorithm_1_select_algorithm_1(
    changes: dict[str, str], method: str, iterations: int
) -> None:
    parameters = launch_parameters(given(**changes))["planner"]
    assert (parameters["method"], parameters["bat.iterations"]) == (method, iterations)


def test_the_shipped_parameters_use_the_predictive_planner() -> None:
    parameters = yaml.safe_load(
        (LAUNCH.parent / "config/planner.yaml").read_text(encoding="utf-8")
    )
    planner = parameters["/**/planner"]["ros__parameters"]
    assert (planner["method"], planner["bat.iterations"]) == ("predictive", 1)


def test_arguments_reach_the_nodes() -> None:
    parameters = launch_parameters(
        given(
            scenario="case2",
            seed="5",
            algorithm="ba",
            reading="fig1",
            real_time="false",
            record="true",
            bag="my_bag",
        )
    )
    assert next(iter(parameters)) == "recorder"
    assert (parameters["recorder"]["output"], parameters["recorder"]["nodes"]) == (
        "my_bag",
        ",".join(NODES),
    )
    assert parameters["planner"]["wait_for"] == ",".join((*NODES, "recorder"))
    assert parameters["planner"]["seed"] == 5
    assert (parameters["planner"]["bat.algorithm"], parameters["planner"]["swarm"]) == (
        "ba",
        "persistent",
    )
    assert (
        parameters["world_sim"]["lockstep"],
        "case2" in parameters["world_sim"]["scenario"],
    ) == (
        True,
        True,
    )


def test_a_fleet_s_nodes_have_parameters_per_namespace() -> None:
    parameters = launch_parameters(given(scenario="swap", record="true"))
    robots = [f"robot{number}" for number in range(10)]
    of_robots = [f"{robot}/{node}" for robot in robots for node in OF_ROBOT]
    assert list(parameters) == ["recorder", "world_sim", *of_robots]
    assert parameters["recorder"]["namespaces"] == ",".join(robots)
    assert parameters["recorder"]["nodes"].split(",") == ["world_sim", *of_robots]
    assert len({parameters[f"{robot}/planner"]["seed"] for robot in robots}) == len(robots)
    assert not parameters["world_sim"]["lockstep"]


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
        launch_parameters(given(**{name: value}))
    assert str(caught.value).startswith(line)


FILES = {
    "simulate": ARGUMENTS,
    "planner": PLANNER_ARGUMENTS,
    "replay": REPLAY_ARGUMENTS,
}
STARTED = {
    "simulate": ["world_sim", "virtual_sensor", "planner"],
    "planner": ["virtual_sensor", "planner"],
    "replay": ["replay"],
}


@pytest.mark.parametrize("name", FILES)
def test_every_argument_is_described_and_its_default_is_a_choice(name: str) -> None:
    for argument in FILES[name].values():
        assert len(argument.description) > 5
        assert not argument.choices or argument.default in argument.choices


@pytest.mark.parametrize("name", FILES)
def test_launch_file_is_what_launch_expects(name: str) -> None:
    """Read by launch itself where it is installed (it is no wheel), otherwise by its stub."""
    path = LAUNCH / f"{name}.launch.py"
    if importlib.util.find_spec("launch_ros") is not None:
        sources = import_module("launch.launch_description_sources")
        description = sources.get_launch_description_from_python_launch_file(str(path))
        assert [a.name for a in description.get_launch_arguments()] == list(FILES[name])
        return
    assert declared(path.name) == {
        argument_name: (argument.default, argument.description, list(argument.choices) or None)
        for argument_name, argument in FILES[name].items()
    }
    given = {"bag": "runs/mine/bag"} if name == "replay" else {}
    nodes = launched(path.name, given)
    assert [node.name for node in nodes] == STARTED[name]
    for node in nodes:
        assert (node.package, node.executable) == ("mfba_planner", node.name)
        assert node.ended(0).reason == f"{node.name} has ended", "when one ends, all are shut down"
        # launch itself ends with 1 after an exception, and with 0 after a shutdown.
        with pytest.raises(RuntimeError, match=f"^{node.name} ended with exit code 1; see above"):
            node.ended(1)
        assert node.ended(1, is_shutdown=True).reason == f"{node.name} has ended"


def test_the_xml_launch_file_declares_and_starts_the_same() -> None:
    root = ElementTree.parse(LAUNCH / "planner.launch.xml").getroot()
    given = root.findall("arg")
    declared = {a.get("name"): (a.get("default"), a.get("description")) for a in given}
    assert declared == {
        name: (argument.default, argument.description)
        for name, argument in PLANNER_ARGUMENTS.items()
    }
    (included,) = root.iter("include")
    folder = "$(find-pkg-share mfba_planner)/launch"
    assert included.get("file") == f"{folder}/planner.launch.py"
    passed = [(argument.get("name"), argument.get("value")) for argument in included.iter("arg")]
    assert passed == [(name, f"$(var {name})") for name in PLANNER_ARGUMENTS]
    assert [child.tag for child in root if child.tag != "arg"] == ["include"], "and nothing else"


def by_default(arguments: Any) -> dict[str, str]:
    return {name: argument.default for name, argument in arguments.items()}


def test_on_a_robot_the_sensor_reads_the_scan_and_the_shipped_file_overrides() -> None:
    sensor, planner = robot_nodes(by_default(PLANNER_ARGUMENTS))
    assert sensor.parameters["source"] == "scan"
    assert planner.parameters == {
        "use_sim_time": False,
        "autostart": True,
        "enable_stamped_cmd_vel": False,
    }
    (file,) = {*sensor.files, *planner.files}
    assert Path(file).samefile(LAUNCH.parent / "config/planner.yaml")
    assert sensor.remaps == planner.remaps == ()


def test_remaps_and_files_reach_the_nodes_of_a_robot(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text("{}")
    changes = {"scan": "/front/scan", "odom": "wheel/odom", "stamped": "true"}
    changes["params_file"] = str(mine)
    sensor, planner = robot_nodes(by_default(PLANNER_ARGUMENTS) | changes)
    assert sensor.remaps == (("scan", "/front/scan"), ("odom", "wheel/odom"))
    assert planner.remaps == sensor.remaps
    assert planner.parameters["enable_stamped_cmd_vel"] is True
    assert sensor.files == planner.files == (str(mine),)
    with pytest.raises(InputError, match="params_file:=nowhere: does not exist"):
        robot_nodes(by_default(PLANNER_ARGUMENTS) | {"params_file": "nowhere"})


def test_replay_gets_valid_command_line_arguments() -> None:
    given = by_default(REPLAY_ARGUMENTS) | {"bag": "runs/mine", "rate": "2.5", "loop": "true"}
    (replay,) = replay_nodes(given)
    settings = parse(list(replay.arguments))
    assert (settings.bag, settings.rate, settings.loop) == ("runs/mine", 2.5, True)
    assert settings.inputs_of == ()
    planner, replay = replay_nodes(given | {"planner": "true"})
    assert planner.parameters == {"lockstep": True}
    settings = parse(list(replay.arguments))
    assert (settings.inputs_of, settings.wait_for_subscribers) == (("planner",), ())
    with pytest.raises(InputError, match=r"^bag:= is empty; give a bag"):
        replay_nodes(by_default(REPLAY_ARGUMENTS))


@pytest.mark.parametrize("name", FILES)
def test_every_launch_file_has_a_namespace(name: str) -> None:
    given = {"namespace": "robot1"} | ({"bag": "runs/mine/bag"} if name == "replay" else {})
    assert {node.full_name for node in launched(f"{name}.launch.py", given)} == {
        f"robot1/{node}" for node in STARTED[name]
    }


@pytest.mark.parametrize("namespace", ["", "robot1"])
def test_nodes_accept_the_shipped_parameters_in_any_namespace(
    graph: Graph, namespace: str
) -> None:
    file = ["--ros-args", "--params-file", str(LAUNCH.parent / "config/planner.yaml")]
    planner = graph.start(PlannerNode, {}, cli_args=file, namespace=namespace)
    sensor = graph.start(VirtualSensor, {}, cli_args=file, namespace=namespace)
    assert sensor.settings.source is Source.SCAN
    for node, found in (
        ("planner", flatten(planner.settings) | flatten(planner.path_planner.params)),
        ("virtual_sensor", flatten(sensor.settings) | flatten(sensor.sensor)),
    ):
        defaults = {k: v for params in reference.NODES[node] for k, v in flatten(params).items()}
        assert found == defaults | reference.ROBOT["*"] | reference.ROBOT[node]


def test_what_both_nodes_need_stands_once_in_the_shipped_parameters() -> None:
    text = (LAUNCH.parent / "config/planner.yaml").read_text(encoding="utf-8")
    for name in ("robot_radius_m", "scan_yaw", "odom_frame", "input_timeout_s"):
        assert len(re.findall(rf"^ +(?:# )?{name}:", text, re.MULTILINE)) == 1, name


def test_a_robot_with_the_shipped_parameters_stops_in_time() -> None:
    planner = reference.ROBOT["planner"] | reference.ROBOT["*"]
    watch_s = 0.25 * planner["input_timeout_s"]
    assert planner["input_timeout_s"] + watch_s < 0.32
    assert planner["step_length_m"] / planner["speed_mps"] == pytest.approx(0.1)
