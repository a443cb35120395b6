# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba verify`, not a command: recordings of other programs (LaserScan, Odometry)."""

from __future__ import annotations

import argparse
import math
from collections import Counter
from pathlib import Path

from ...core.errors import BagError, ConfigError
from ...core.geometry import Point
from ...launcher.set_option import with_settings
from ...perception.no_return import NoReturn
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ...recording.fleet_topics import NO_NAMESPACE, with_robot_name
from ...verification.redecide import RedecideParams, RedecideResult, redecide_recording
from ...verification.verify_bag import Report

SHOWN = 10  # faults printed at most
_NEEDS_OWN_BAG = {"closed_loop": "--closed-loop", "picture": "--picture", "robots": "--robot"}
_FOREIGN_ONLY = ("goal", "seed", "robot_radius", "scan_yaw", "scan_no_return", "scan", "odom")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for what such a recording does not contain."""
    group = parser.add_argument_group(
        "a recording of a LaserScan and Odometry, not made by mfba",
        "It has no decisions to compare with: prints the computed decisions' digest.",
    )
    group.add_argument(
        "--goal", type=float, nargs=2, metavar=("X", "Y"), help="goal, m (default: as recorded)"
    )
    group.add_argument("--seed", type=int, help="seed of all randomness (default: 0)")
    group.add_argument(
        "--robot-radius",
        type=float,
        metavar="M",
        help="radius of the robot, m, added to every lidar return",
    )
    group.add_argument(
        "--scan-yaw",
        type=float,
        metavar="RAD",
        help="yaw of the scan's frame in the robot's, rad (default: from /tf_static)",
    )
    group.add_argument(
        "--scan-no-return",
        choices=[member.value for member in NoReturn],
        help="range by which the lidar reports that nothing is there (default: inf, as REP-117)",
    )
    group.add_argument("--scan", metavar="TOPIC", help="scan topic, if there are several")
    group.add_argument("--odom", metavar="TOPIC", help="odometry topic, if there are several")


def refuse_arguments(bag: Path, parsed: argparse.Namespace) -> None:
    """Raise ConfigError for one of these arguments with a bag of mfba."""
    for name in _FOREIGN_ONLY:
        if getattr(parsed, name) is not None:
            raise ConfigError(
                f"--{name.replace('_', '-')}: {bag} contains that already; leave it "
                "out (--set changes parameters)"
            )


def report(bag: Path, parsed: argparse.Namespace) -> int:
    """Compute the decisions and print modes and digest. Raises BagError for faults."""
    for name, option in _NEEDS_OWN_BAG.items():
        if getattr(parsed, name):
            raise ConfigError(
                f"{option}: {bag} was not recorded by mfba, so there is no world to simulate; "
                "leave it out"
            )
    result = redecide_recording(bag, _robot(parsed))
    print_remarks(result)
    modes = Counter(decision.mode.value for decision in result.decided)
    print("modes: " + ", ".join(f"{mode} {count}" for mode, count in sorted(modes.items())))
    print(f"computed: {len(result.decided)} decisions, digest {result.digest}")
    if result.faults:
        raise BagError(
            f"{bag}: {len(result.faults)} faults, the first: {result.faults[0]}; see above"
        )
    return 0


def _robot(parsed: argparse.Namespace) -> RedecideParams:
    from ...ros.node_settings import VirtualSensorSettings  # a bag of mfba does not need it

    planner, sensor = with_settings(PlannerParams(), SensorParams(), parsed.settings)
    values = {"robot_radius_m": parsed.robot_radius, "scan_yaw": parsed.scan_yaw}
    settings = VirtualSensorSettings(**{k: v for k, v in values.items() if v is not None})
    return RedecideParams(
        robot_radius_m=settings.robot_radius_m,
        scan_yaw_rad=parsed.scan_yaw,
        scan_no_return=NoReturn(parsed.scan_no_return or NoReturn.INF),
        goal=_goal(parsed.goal),
        scan=parsed.scan or "",
        odom=parsed.odom or "",
        planner=planner,
        sensor=sensor,
        seed=parsed.seed or 0,
    )


def _goal(goal: list[float] | None) -> Point | None:
    if goal is None:
        return None
    if not all(map(math.isfinite, goal)):
        raise ConfigError(f"--goal {goal[0]} {goal[1]}: not finite; give metres in odom")
    return (goal[0], goal[1])


def print_remarks(report: Report | RedecideResult, robot: str = NO_NAMESPACE) -> None:
    """Print the notes, then at most SHOWN faults."""
    for note in report.notes:
        print(with_robot_name(robot, f"note: {note}"))
    for fault in report.faults[:SHOWN]:
        print(with_robot_name(robot, f"fault: {fault}"))
    if len(report.faults) > SHOWN:
        print(with_robot_name(robot, f"fault: ... and {len(report.faults) - SHOWN} more"))
