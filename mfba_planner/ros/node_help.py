# SPDX-License-Identifier: Apache-2.0
"""`planner --help` and the like: what a node's command line takes; needs no ROS."""

from __future__ import annotations

import textwrap
from enum import Enum
from typing import Any

from ..core.argument_parser import Parser
from ..core.option_specs import Spec, walk
from ..core.ros_arguments import NO_PARAMETER_SERVICES
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..simulation.robot_model import Robot
from . import node_settings

PARAMETERS: dict[str, tuple[Any, ...]] = {
    "planner": (node_settings.PlannerSettings(), PlannerParams()),
    "virtual_sensor": (node_settings.VirtualSensorSettings(), SensorParams()),
    "world_sim": (
        node_settings.WorldSimSettings(),
        node_settings.RobotParameters(robot=Robot()),
    ),
    "recorder": (node_settings.RecorderSettings(),),
}
_DESCRIPTIONS = {
    "planner": "Decides on odometry and sectors or a scan, and sends cmd_vel.",
    "virtual_sensor": "Turns obstacles, or the scan of any lidar, into sectors.",
    "world_sim": "Simulates a scenario: robot, obstacles and sensors.",
    "recorder": "Writes the topics of the graph into an MCAP bag.",
}
_EPILOG = (
    "--ros-args -p NAME:=VALUE, -r FROM:=TO or --params-file FILE may follow.\n\nParameters:\n"
)


def check_arguments(node: str, own: list[str]) -> None:
    """Print the help for --help, and exit. Raises ConfigError for any other argument."""
    parser = Parser(
        prog=node,
        usage=f"{node} [-h] [{NO_PARAMETER_SERVICES}] [--ros-args ...]",
        description=_DESCRIPTIONS[node],
        epilog=_EPILOG + "\n".join(_lines(node)),
    )
    parser.add_argument(
        NO_PARAMETER_SERVICES,
        action="store_true",
        help="no services for parameters and the life cycle; for many nodes in one graph",
    )
    parser.parse(own)


def parameter_names(node: str) -> list[str]:
    """The names of a node's parameters, rclpy's own one included."""
    return ["use_sim_time", *(name for one in PARAMETERS[node] for name, _, _ in walk(one))]


def _lines(node: str) -> list[str]:
    lines = []
    for settings in PARAMETERS[node]:
        for name, default, item in walk(settings):
            spec: Spec = item.metadata["spec"]
            value = default.value if isinstance(default, Enum) else default
            unit = f" {spec.unit}" if spec.unit else ""
            shown = f"{str(value).lower() if isinstance(value, bool) else value}{unit}" or '""'
            text = f"  {name} ({shown}): {spec.doc}"
            lines.append(textwrap.fill(text, 99, subsequent_indent="      "))
    return lines
