# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner simulate.launch.py`: the graph, for watching with ROS tools.

It runs until Ctrl-C. `mfba run` is the one to use for results: it ends at the goal, and judges.
"""

from __future__ import annotations

from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from mfba_planner.launcher.by_launch import ARGUMENTS, told_by_launch


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    declared = [
        DeclareLaunchArgument(
            name,
            default_value=argument.default,
            description=argument.description,
            choices=list(argument.choices) or None,
        )
        for name, argument in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    """The graph's nodes; when one ends, so do all."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
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
        for name, parameters in told_by_launch(given).items()
    ]


def _literally(parameters: dict[str, Any]) -> dict[str, Any]:
    """Keep texts texts: launch would read them as YAML."""
    return {
        name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
        for name, value in parameters.items()
    }
