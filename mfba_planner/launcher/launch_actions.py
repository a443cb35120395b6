# SPDX-License-Identifier: Apache-2.0
"""Arguments and nodes in the words of `launch`, which is no wheel: for launch/*.py alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from .robot_launch import Start
from .simulate_launch import Argument


def describe(
    arguments: Mapping[str, Argument], starts: Callable[[Mapping[str, str]], list[Start]]
) -> LaunchDescription:
    """Declare the arguments and start what they lead to; when one node ends, so do all."""
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
        return [_node(start, namespace) for start in starts(given)]

    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])


def _node(start: Start, namespace: str) -> Node:
    above, _, program = start.name.rpartition("/")
    return Node(
        package="mfba_planner",
        executable=program,
        name=program,
        namespace="/".join(part for part in (namespace, above) if part),
        output="screen",
        parameters=[_literally(start.parameters), *start.files],
        remappings=list(start.remaps),
        arguments=list(start.arguments),
        on_exit=Shutdown(reason=f"{start.name} has ended"),
    )


def _literally(parameters: dict[str, Any]) -> dict[str, Any]:
    """Keep texts texts: launch would read them as YAML."""
    return {
        name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
        for name, value in parameters.items()
    }
