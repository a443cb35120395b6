# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner simulate.launch.py`: simulated world and nodes, for ROS tools.

It runs until Ctrl-C. For results use `mfba run`: it ends at the goal and evaluates the run.
"""

from __future__ import annotations

from collections.abc import Mapping

from launch.launch_description import LaunchDescription

from mfba_planner.launcher.launch_actions import make_description
from mfba_planner.launcher.robot_launch_description import NodeStart
from mfba_planner.launcher.simulate_launch_description import (
    ARGUMENTS,
    launch_parameters,
    params_files,
)


def generate_launch_description() -> LaunchDescription:
    """Called by `ros2 launch`."""
    return make_description(ARGUMENTS, _node_starts)


def _node_starts(given: Mapping[str, str]) -> list[NodeStart]:
    files = params_files(given["params_file"])
    return [
        NodeStart(name=name, parameters=parameters, files=files)
        for name, parameters in launch_parameters(given).items()
    ]
