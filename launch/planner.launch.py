# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner planner.launch.py`: the planner on a real robot with a lidar."""

from __future__ import annotations

from launch.launch_description import LaunchDescription

from mfba_planner.launcher.launch_actions import describe
from mfba_planner.launcher.robot_launch import PLANNER_ARGUMENTS, robot


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    return describe(PLANNER_ARGUMENTS, robot)
