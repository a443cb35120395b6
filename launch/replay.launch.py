# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch mfba_planner replay.launch.py bag:=...`: a bag for viewers, or for a planner."""

from __future__ import annotations

from launch.launch_description import LaunchDescription

from mfba_planner.launcher.launch_actions import describe
from mfba_planner.launcher.robot_launch import REPLAY_ARGUMENTS, replayed


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    return describe(REPLAY_ARGUMENTS, replayed)
