# SPDX-License-Identifier: Apache-2.0
"""Arguments and nodes of planner.launch.py and replay.launch.py; needs no `launch`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..core.errors import InputError
from ..core.shipped_files import config_path
from .simulate_launch_description import LaunchArgument, params_files

TRUE_OR_FALSE = ("true", "false")
ENABLED = {"true": True, "false": False}


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeStart:
    """How one node is started; files override parameters, later files override earlier ones.

    name is PROGRAM or NAMESPACE/PROGRAM.
    """

    name: str
    parameters: dict[str, Any] = field(default_factory=dict)
    files: tuple[str, ...] = ()
    remaps: tuple[tuple[str, str], ...] = ()
    arguments: tuple[str, ...] = ()


PLANNER_ARGUMENTS = {
    "params_file": LaunchArgument("", "a --params-file of both nodes; empty: config/planner.yaml"),
    "namespace": LaunchArgument("", "namespace of both nodes and their topics"),
    "use_sim_time": LaunchArgument("false", "time comes from /clock", TRUE_OR_FALSE),
    "autostart": LaunchArgument("true", "activate the planner at once", TRUE_OR_FALSE),
    "scan": LaunchArgument("scan", "topic of the lidar (sensor_msgs/LaserScan)"),
    "odom": LaunchArgument("odom", "topic of the odometry (nav_msgs/Odometry)"),
    "cmd_vel": LaunchArgument("cmd_vel", "topic of the velocity command"),
    "goal_pose": LaunchArgument("goal_pose", "topic of a goal (RViz: 2D Goal Pose)"),
    "waypoints": LaunchArgument("waypoints", "topic of a sequence of goals (nav_msgs/Path)"),
    "map": LaunchArgument("map", "topic of a map known before, where known_map is true"),
    "stamped": LaunchArgument("false", "cmd_vel is a TwistStamped, as in Nav2", TRUE_OR_FALSE),
}


def robot_nodes(given: Mapping[str, str]) -> list[NodeStart]:
    """virtual_sensor on a lidar's scan, and planner. InputError for a missing params_file."""
    files = params_files(given["params_file"]) or (str(config_path("planner.yaml")),)
    sim_time = {"use_sim_time": ENABLED[given["use_sim_time"]]}

    def remaps(*names: str) -> tuple[tuple[str, str], ...]:
        return tuple((name, given[name]) for name in names if given[name] != name)

    return [
        NodeStart(
            name="virtual_sensor",
            parameters={**sim_time, "source": "scan"},
            files=files,
            remaps=remaps("scan", "odom"),
        ),
        NodeStart(
            name="planner",
            parameters={
                **sim_time,
                "autostart": ENABLED[given["autostart"]],
                "enable_stamped_cmd_vel": ENABLED[given["stamped"]],
            },
            files=files,
            remaps=remaps("scan", "odom", "cmd_vel", "goal_pose", "waypoints", "map"),
        ),
    ]


REPLAY_ARGUMENTS = {
    "bag": LaunchArgument("", "bag directory or .mcap file; must be given"),
    "rate": LaunchArgument("1.0", "bag seconds per second"),
    "start_offset": LaunchArgument("0.0", "seconds of the bag to skip"),
    "loop": LaunchArgument("false", "start again at the end", TRUE_OR_FALSE),
    "clock": LaunchArgument("0.0", "rate of /clock, Hz; 0: no /clock"),
    "planner": LaunchArgument(
        "false", "start a planner that decides from the bag's odom and sectors", TRUE_OR_FALSE
    ),
    "params_file": LaunchArgument("", "a --params-file of that planner; empty: its defaults"),
    "namespace": LaunchArgument("", "namespace of that planner, as of its topics in the bag"),
}


def replay_nodes(given: Mapping[str, str]) -> list[NodeStart]:
    """replay, and before it a planner if requested. InputError without a bag."""
    if not given["bag"]:
        raise InputError("bag:= is empty; give a bag directory or .mcap file, bag:=runs/mine/bag")
    arguments = [given["bag"], "--rate", given["rate"], "--start-offset", given["start_offset"]]
    arguments += ["--clock", given["clock"]] + ["--loop"] * ENABLED[given["loop"]]
    if not ENABLED[given["planner"]]:
        return [NodeStart(name="replay", arguments=tuple(arguments))]
    files = params_files(given["params_file"])
    arguments += ["--inputs-of", "planner", "--wait-for-subscribers"]
    return [
        NodeStart(name="planner", parameters={"lockstep": True}, files=files),
        NodeStart(name="replay", arguments=tuple(arguments)),
    ]
