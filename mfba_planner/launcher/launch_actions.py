# SPDX-License-Identifier: Apache-2.0
"""LaunchArgument and NodeStart as actions of ROS's `launch` (not on PyPI), for launch/*.py."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.events.process import ProcessExited
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from .robot_launch_description import NodeStart
from .simulate_launch_description import LaunchArgument


def make_description(
    arguments: Mapping[str, LaunchArgument],
    node_starts: Callable[[Mapping[str, str]], list[NodeStart]],
) -> LaunchDescription:
    """Declare the arguments and start the nodes; when one node ends, all are shut down.

    `ros2 launch` then returns 0, but 1 where that node ended with an error.
    """
    declared = [
        DeclareLaunchArgument(
            name,
            default_value=argument.default,
            description=argument.description,
            choices=list(argument.choices) or None,
        )
        for name, argument in arguments.items()
    ]

    def nodes(context: LaunchContext) -> list[Node]:
        given = {name: LaunchConfiguration(name).perform(context) for name in arguments}
        namespace = given.get("namespace", "")
        return [_node(start, namespace) for start in node_starts(given)]

    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])


def _node(start: NodeStart, namespace: str) -> Node:
    above, _, program = start.name.rpartition("/")
    return Node(
        package="mfba_planner",
        executable=program,
        name=program,
        namespace="/".join(name for name in (namespace, above) if name),
        output="screen",
        parameters=[_keep_strings(start.parameters), *start.files],
        remappings=list(start.remaps),
        arguments=list(start.arguments),
        on_exit=partial(_on_exit, start.name),
    )


def _on_exit(name: str, event: ProcessExited, context: LaunchContext) -> list[Shutdown]:
    """Shut down. RuntimeError, after which `launch` does so and returns 1, for a failed node."""
    if event.returncode and not context.is_shutdown:
        raise RuntimeError(f"{name} ended with exit code {event.returncode}; see above")
    return [Shutdown(reason=f"{name} has ended")]


def _keep_strings(parameters: dict[str, Any]) -> dict[str, Any]:
    """Mark strings as strings: launch would parse them as YAML."""
    return {
        name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
        for name, value in parameters.items()
    }
