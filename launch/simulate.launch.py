# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner simulate.launch.py`: the graph, for watching with ROS tools.

It runs until Ctrl-C. `mfba run` is the one to use for results: it ends at the goal, and judges.
"""

from __future__ import annotations

import json
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.options import override
from mfba_planner.paper import readings
from mfba_planner.run_config import NODES, RunConfig, node_parameters, run_facts
from mfba_planner.scenarios import load_scenario

RECORDER = "recorder"
TRUE_OR_FALSE = ["true", "false"]

# name: default, what it means, choices where there are few
ARGUMENTS: dict[str, tuple[str, str, list[str] | None]] = {
    "scenario": ("case1", "a shipped scenario's name, or a .yaml file", None),
    "seed": ("0", "seed of all randomness", None),
    "algorithm": ("mfba", "law of beta in eq. 4", ["mfba", "ba"]),
    "reading": ("section6", "how section 6.2 is read", list(readings.PLANNERS)),
    "real_time": ("true", "tick on a wall timer; false: as fast as it goes", TRUE_OR_FALSE),
    "speed_factor": ("1.0", "simulated seconds per wall second, in real time", None),
    "record": ("false", "write a bag", TRUE_OR_FALSE),
    "bag": ("", "bag directory to create; empty: a new one below ./runs", None),
    "params_file": ("", "a --params-file for all nodes, which has the last word", None),
}


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text, choices=choices)
        for name, (default, text, choices) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    """The graph's nodes; when one ends, so do all."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    config = _config(given)
    peers = (*NODES, RECORDER) if given["record"] == "true" else NODES
    told = node_parameters(config, peers)
    told["world_sim"]["start_paused"] = False  # nobody is there to let it go
    if RECORDER in peers:
        told[RECORDER] = {
            "output": given["bag"],
            "nodes": ",".join(NODES),
            "sim_time": True,
            "run": json.dumps(run_facts(config)),
        }
    more = [given["params_file"]] if given["params_file"] else []
    return [
        Node(
            package="mfba_planner",
            executable=name,
            name=name,
            output="screen",
            parameters=[_literally(parameters), *more],
            on_exit=Shutdown(reason=f"{name} has ended"),
        )
        for name, parameters in told.items()
    ]


def _config(given: dict[str, str]) -> RunConfig:
    planner = readings.planner(given["reading"])
    return RunConfig(
        scenario=load_scenario(given["scenario"]),
        planner=override(planner, {"bat.algorithm": given["algorithm"]}),
        seed=_number("seed", given["seed"], int),
        real_time=given["real_time"] == "true",
        speed_factor=_number("speed_factor", given["speed_factor"], float),
    )


def _number(name: str, text: str, kind: type) -> Any:
    try:
        return kind(text)
    except ValueError:
        raise ConfigError(f"{name}:={text}: not a number; give one") from None


def _literally(parameters: dict[str, Any]) -> dict[str, Any]:
    """Keep texts texts: launch would read them as YAML."""
    return {
        name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
        for name, value in parameters.items()
    }
