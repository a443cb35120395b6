# SPDX-License-Identifier: Apache-2.0
"""The command lines of nodes: their own arguments, and those of ROS."""

from __future__ import annotations

# An argument of a node's own: of a fleet each service of each node is told to every other one.
NO_PARAMETER_SERVICES = "--no-parameter-services"


def split_ros_args(args: list[str]) -> tuple[list[str], list[str]]:
    """A program's own arguments, and those from --ros-args to -- or the end.

    rcl must not get a program's own: it would read FROM:=TO as a deprecated remap rule.
    """
    own_and_ros: tuple[list[str], list[str]] = ([], [])
    is_ros = False
    for arg in args:
        starts, ends = arg == "--ros-args", is_ros and arg == "--"
        is_ros = (is_ros or starts) and not ends
        own_and_ros[is_ros or ends].append(arg)
    return own_and_ros
