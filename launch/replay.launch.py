# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner replay.launch.py bag:=...`: replay a bag, for viewers or a planner."""

from __future__ import annotations

from launch.launch_description import LaunchDescription

from mfba_planner.launcher.launch_actions import make_description
from mfba_planner.launcher.robot_launch_description import REPLAY_ARGUMENTS, replay_nodes


def generate_launch_description() -> LaunchDescription:
    """Called by `ros2 launch`."""
    return make_description(REPLAY_ARGUMENTS, replay_nodes)
