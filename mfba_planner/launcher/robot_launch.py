# SPDX-License-Identifier: Apache-2.0
"""What planner.launch.py and replay.launch.py offer and start; tested without launch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.resources import config_path
from .simulate_launch import Argument

TRUE_OR_FALSE = ("true", "false")
ENABLED = {"true": True, "false": False}


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """How one node is started; of parameters and files, the later has the last word.

    name is a program's, or NAMESPACE/it.
    """

    name: str
    parameters: dict[str, Any] = field(default_factory=dict)
    files: tuple[str, ...] = ()
    remaps: tuple[tuple[str, str], ...] = ()
    arguments: tuple[str, ...] = ()


PLANNER_ARGUMENTS = {
    "params_file": Argument("", "a --params-file of both nodes; empty: config/planner.yaml"),
    "namespace": Argument("", "namespace of both nodes and their topics"),
    "use_sim_time": Argument("false", "time comes from /clock", TRUE_OR_FALSE),
    "autostart": Argument("true", "activate the planner at once", TRUE_OR_FALSE),
    "scan": Argument("scan", "topic of the lidar (sensor_msgs/LaserScan)"),
    "odom": Argument("odom", "topic of the odometry (nav_msgs/Odometry)"),
    "cmd_vel": Argument("cmd_vel", "topic of the velocity that is commanded"),
    "goal_pose": Argument("goal_pose", "topic of a goal (RViz: 2D Goal Pose)"),
    "waypoints": Argument("waypoints", "topic of goals in a row (nav_msgs/Path)"),
    "stamped": Argument("false", "cmd_vel is a TwistStamped, as in Nav2", TRUE_OR_FALSE),
}


def robot(given: Mapping[str, str]) -> list[Start]:
    """virtual_sensor on a lidar's scan, and planner. InputError for a file that is not there."""
    files = (_params_file(given["params_file"]),)
    sim_time = {"use_sim_time": ENABLED[given["use_sim_time"]]}

    def remaps(*names: str) -> tuple[tuple[str, str], ...]:
        return tuple((name, given[name]) for name in names if given[name] != name)

    return [
        Start(
            name="virtual_sensor",
            parameters={**sim_time, "source": "scan"},
            files=files,
            remaps=remaps("scan", "odom"),
        ),
        Start(
            name="planner",
            parameters={
                **sim_time,
                "autostart": ENABLED[given["autostart"]],
                "enable_stamped_cmd_vel": ENABLED[given["stamped"]],
            },
            files=files,
            remaps=remaps("odom", "cmd_vel", "goal_pose", "waypoints"),
        ),
    ]


REPLAY_ARGUMENTS = {
    "bag": Argument("", "bag directory or .mcap file; must be given"),
    "rate": Argument("1.0", "bag seconds per second"),
    "start_offset": Argument("0.0", "skip so many seconds"),
    "loop": Argument("false", "begin again at the end", TRUE_OR_FALSE),
    "clock": Argument("0.0", "publish /clock so many times a second; 0: not at all"),
    "planner": Argument(
        "false", "start a planner that decides again on the bag's odom and sectors", TRUE_OR_FALSE
    ),
    "params_file": Argument("", "a --params-file of that planner; empty: its defaults"),
}


def replayed(given: Mapping[str, str]) -> list[Start]:
    """replay, and a planner before it if asked for. InputError without a bag."""
    if not given["bag"]:
        raise InputError("bag:= is empty; give a bag directory or .mcap file, bag:=runs/mine/bag")
    words = [given["bag"], "--rate", given["rate"], "--start-offset", given["start_offset"]]
    words += ["--clock", given["clock"]] + ["--loop"] * ENABLED[given["loop"]]
    if not ENABLED[given["planner"]]:
        return [Start(name="replay", arguments=tuple(words))]
    files = (_params_file(given["params_file"]),) if given["params_file"] else ()
    words += ["--inputs-of", "planner", "--wait-for-subscribers"]
    return [
        Start(name="planner", parameters={"lockstep": True}, files=files),
        Start(name="replay", arguments=tuple(words)),
    ]


def _params_file(given: str) -> str:
    path = Path(given) if given else config_path("planner.yaml")
    if not path.is_file():
        raise InputError(f"params_file:={given}: not there; give a YAML file")
    return str(path)
