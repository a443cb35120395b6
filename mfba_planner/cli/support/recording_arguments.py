# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba verify` and `mfba decide`, not a command: what a recording does not contain."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError
from ...core.geometry import Point
from ...core.lidar_extrinsics import PARAMETERS, LidarExtrinsics
from ...core.option_specs import flatten, override
from ...perception.no_return import NoReturn
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ...recording.params_file import read_params_file
from ...verification.redecide import RedecideParams

NAMES = (
    "goal", "goal_topic", "seed", "robot_radius", *PARAMETERS, "scan_no_return", "scan", "odom",
)  # fmt: skip
PLANNER, SENSOR = "planner", "virtual_sensor"
NODES = (PLANNER, SENSOR)

Parameters = Mapping[str, Mapping[str, Any]]  # by node


def add_to(group: Any) -> None:
    """Add the arguments to a parser or a group of one."""
    group.add_argument(
        "--goal", type=float, nargs=2, metavar=("X", "Y"), help="goal, m (default: as recorded)"
    )
    group.add_argument("--goal-topic", metavar="TOPIC", help="goals (default: goal_pose)")
    group.add_argument("--seed", type=int, help="seed of all randomness (default: 0)")
    group.add_argument(
        "--robot-radius",
        type=float,
        metavar="M",
        help="radius of the robot, m, added to every lidar return (default: 0.3)",
    )
    for name, what in (("x", "ahead of"), ("y", "to the left of")):
        group.add_argument(
            f"--scan-{name}", type=float, metavar="M",
            help=f"the lidar, m {what} the robot's centre (default: from /tf_static, /tf)",
        )  # fmt: skip
    group.add_argument(
        "--scan-yaw",
        type=float,
        metavar="RAD",
        help="yaw of the scan's frame in the robot's, rad (default: from /tf_static, /tf)",
    )
    group.add_argument(
        "--scan-flipped",
        action="store_true",
        default=None,
        help="the lidar is upside down (default: from /tf_static, /tf)",
    )
    group.add_argument(
        "--scan-no-return",
        choices=[member.value for member in NoReturn],
        help="range by which the lidar reports that nothing is there (default: inf, as REP-117)",
    )
    group.add_argument(
        "--scan",
        metavar="TOPIC",
        help="scan topic, if there are several; of several lidars all, separated by commas",
    )
    group.add_argument("--odom", metavar="TOPIC", help="odometry topic, if there are several")


def add_params_file(group: Any) -> None:
    """Add --params-file."""
    group.add_argument(
        "--params-file",
        type=Path,
        metavar="YAML",
        help="parameters of planner and virtual_sensor, as of config/planner.yaml",
    )


def given_parameters(parsed: argparse.Namespace) -> Parameters:
    """The parameters of --params-file, none without it. Raises ConfigError.

    As the nodes do, it warns of names that no node has: a file may be for other nodes too.
    """
    if parsed.params_file is None:
        return {}
    from ...ros.node_help import parameter_names  # a bag of mfba does not need it

    found = read_params_file(parsed.params_file, NODES)
    known = {name for node in NODES for name in parameter_names(node)}
    for name in sorted({name for values in found.values() for name in values} - known):
        print(
            f"note: --params-file {parsed.params_file}: {name}: no such parameter of "
            f"{' or '.join(NODES)}; `{PLANNER} --help` and `{SENSOR} --help` list them",
            file=sys.stderr,
        )
    return found


def with_parameters(
    planner: PlannerParams, sensor: SensorParams, given: Parameters
) -> tuple[PlannerParams, SensorParams]:
    """Both with the parameters of their nodes. Raises ConfigError for a refused value."""
    of_planner, of_sensor = (_options(item, given.get(node, {})) for item, node in zip(
        (planner, sensor), NODES))  # fmt: skip
    return override(planner, of_planner), override(sensor, of_sensor)


def _options(defaults: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: values[name] for name in flatten(defaults) if name in values}


def redecide_params(
    parsed: argparse.Namespace, planner: PlannerParams, sensor: SensorParams, given: Parameters
) -> RedecideParams:
    """The arguments, else the parameters of a file. Raises ConfigError for a refused value."""
    from ...ros.node_settings import VirtualSensorSettings  # a bag of mfba does not need it

    both = {**given.get(PLANNER, {}), **given.get(SENSOR, {})}
    extrinsics = {
        name: value
        for name in PARAMETERS
        if (value := _first(getattr(parsed, name), both.get(name))) is not None
    }
    values = {
        "robot_radius_m": _first(parsed.robot_radius, both.get("robot_radius_m")),
        "scan_no_return": _first(parsed.scan_no_return, both.get("scan_no_return")),
        **extrinsics,
    }
    settings = VirtualSensorSettings(**{k: v for k, v in values.items() if v is not None})
    return RedecideParams(
        robot_radius_m=settings.robot_radius_m,
        extrinsics=LidarExtrinsics.of_parameters(extrinsics) if extrinsics else None,
        scan_no_return=settings.scan_no_return,
        goal=_goal(parsed.goal),
        goal_topic=parsed.goal_topic or "",
        scan=parsed.scan or "",
        odom=parsed.odom or "",
        base_frame=str(both.get("base_frame", "")),
        odom_frame=str(both.get("odom_frame", "")),
        scan_frame=str(both.get("scan_frame", "")),
        planner=planner,
        sensor=sensor,
        seed=_first(parsed.seed, both.get("seed")) or 0,
    )


def _first(argument: Any, parameter: Any) -> Any:
    return argument if argument is not None else parameter


def _goal(goal: list[float] | None) -> Point | None:
    if goal is None:
        return None
    if not all(map(math.isfinite, goal)):
        raise ConfigError(f"--goal {goal[0]} {goal[1]}: not finite; give metres in odom")
    return (goal[0], goal[1])
