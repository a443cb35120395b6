# SPDX-License-Identifier: Apache-2.0
"""docs/ros.md keeps its word: its commands name what there is, the node takes what they say."""

import re
import shlex
from pathlib import Path

import pytest
import yaml
from graph import Graph
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger
from test_launch_file import FILES

from mfba_planner.core.options import walk
from mfba_planner.core.planner import PlannerParams
from mfba_planner.core.recovery import RecoveryParams, longest_s
from mfba_planner.node_settings import PlannerSettings, WorldSimSettings
from mfba_planner.ros import topics
from mfba_planner.ros.planner import PlannerNode
from mfba_planner.ros.serialized import type_name

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/ros.md").read_text(encoding="utf-8")
COMMANDS = [
    shlex.split(line)
    for block in re.findall(r"^```sh\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    for line in block.splitlines()
]
GRAPH = {f"/{topic.name.lstrip('/')}": topic for topic in topics.GRAPH}


def starting(*words: str) -> list[list[str]]:
    found = [command[len(words) :] for command in COMMANDS if command[: len(words)] == list(words)]
    assert found, words
    return found


def test_launch_files_and_arguments_exist() -> None:
    for package, file, *arguments in starting("ros2", "launch"):
        assert package == "mfba_planner"
        assert {a.partition(":=")[0] for a in arguments} <= set(FILES[file.partition(".")[0]])


def test_parameters_that_are_set_are_taken(graph: Graph) -> None:
    node = graph.start(PlannerNode, {})
    for name, parameter, value in starting("ros2", "param", "set"):
        assert graph.set_parameter(name.lstrip("/"), parameter, yaml.safe_load(value)) == ""
    for _, parameter in starting("ros2", "param", "describe"):
        assert node.describe_parameter(parameter).description


def test_the_life_cycle_is_walked_as_shown(graph: Graph) -> None:
    node = graph.start(PlannerNode, {"autostart": False})
    for name, label in starting("ros2", "lifecycle", "set"):
        request = ChangeState.Request(transition=Transition(label=label))
        assert graph.call(ChangeState, f"{name}/change_state", request).success
    assert node.state == "active"
    assert starting("ros2", "lifecycle", "get") == [["/planner"]]


def test_the_waypoints_shown_are_gone_to_and_cancelled(graph: Graph) -> None:
    node = graph.start(PlannerNode, {})
    ((_, name, kind, text),) = starting("ros2", "topic", "pub")
    assert type_name(GRAPH[name].type) == kind
    told = yaml.safe_load(text)
    message = topics.WAYPOINTS.type()
    message.header.frame_id = told["header"]["frame_id"]
    for pose in told["poses"]:
        made = topics.GOAL_POSE.type()
        for axis, value in pose["pose"]["position"].items():
            setattr(made.pose.position, axis, value)
        message.poses.append(made)
    graph.writer(GRAPH[name], qos=topics.VIEW_QOS).publish(message)
    graph.until(lambda: node.goals.errands.leg == "1 of 2")
    ((service, kind),) = starting("ros2", "service", "call")
    assert kind == "std_srvs/srv/Trigger"
    assert graph.call(Trigger, service).success


def test_parameters_and_files_that_are_named_exist() -> None:
    declared = {
        name
        for defaults in (PlannerSettings(), PlannerParams(), WorldSimSettings())
        for name, _, _ in walk(defaults)
    }
    named = set(re.findall(r"`((?:caution|recovery)\.\w+|\w+_(?:s|m|mps)|hardware_id)`", PAGE))
    shortened = {"wait_s", "slow_within_m"}
    assert len(named) > 8
    assert named - shortened <= declared
    for file in re.findall(r"(?:config|layout|test)/[\w.]+", PAGE):
        assert (ROOT / file).is_file(), file


def test_the_bound_is_the_one_that_is_printed() -> None:
    params = RecoveryParams(wait_s=2.0, back_off_s=1.0, attempts=3)
    printed = (3 + 1) * (2 * 2.0 + 3 * 0.1) + 3 * (1.0 + 2 * 0.1)
    assert longest_s(params, 0.1) == pytest.approx(printed)
