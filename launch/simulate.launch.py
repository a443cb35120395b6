# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner simulate.launch.py`: the graph, for watching with ROS tools.

It runs until Ctrl-C. `mfba run` is the one to use for results: it ends at the goal, and judges.
"""

from __future__ import annotations

from collections.abc import Mapping

from launch.launch_description import LaunchDescription

from mfba_planner.launcher.launch_actions import describe
from mfba_planner.launcher.robot_launch import Start
from mfba_planner.launcher.simulate_launch import ARGUMENTS, launch_parameters


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    return describe(ARGUMENTS, _starts)


def _starts(given: Mapping[str, str]) -> list[Start]:
    files = (given["params_file"],) if given["params_file"] else ()
    return [
        Start(name=name, parameters=parameters, files=files)
        for name, parameters in launch_parameters(given).items()
    ]
