# SPDX-License-Identifier: Apache-2.0
"""`mfba verify` of a recording that is not ours: decisions from scratch."""

from __future__ import annotations

import argparse
import math
from collections import Counter
from pathlib import Path

from ..core.errors import BagError, ConfigError
from ..core.geometry import Point
from ..launcher.set_option import with_settings
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..recording.robot_topics import NO_NAMESPACE, of_robot
from ..verification.redecide import Redecided, Robot, redecide_recording
from ..verification.verify_bag import Report

SHOWN = 10  # faults; more of them say nothing new
_OURS = {"closed_loop": "--closed-loop", "picture": "--picture", "robots": "--robot"}
_OWN = ("goal", "seed", "robot_radius", "scan_yaw", "scan", "odom")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What such a recording does not say."""
    group = parser.add_argument_group(
        "a recording of a LaserScan and Odometry that is not ours",
        "There is nothing to compare with: decisions from scratch, and their digest.",
    )
    group.add_argument(
        "--goal", type=float, nargs=2, metavar=("X", "Y"), help="in metres (default: recorded)"
    )
    group.add_argument("--seed", type=int, help="of all randomness (default: 0)")
    group.add_argument("--robot-radius", type=float, metavar="M", help="added to every return")
    group.add_argument(
        "--scan-yaw",
        type=float,
        metavar="RAD",
        help="of the scan's frame in the robot's (default: as /tf_static has it)",
    )
    group.add_argument("--scan", metavar="TOPIC", help="where there are several")
    group.add_argument("--odom", metavar="TOPIC", help="where there are several")


def refuse_arguments(bag: Path, found: argparse.Namespace) -> None:
    """Raise ConfigError for one of them with a bag of ours."""
    for name in _OWN:
        if getattr(found, name) is not None:
            raise ConfigError(
                f"--{name.replace('_', '-')}: {bag} says that itself; leave it out "
                "(--set asks what if)"
            )


def report(bag: Path, found: argparse.Namespace) -> int:
    """Decide from scratch and print what there is to say; raises BagError for faults."""
    for name, option in _OURS.items():
        if getattr(found, name):
            raise ConfigError(
                f"{option}: {bag} is not a recording of ours, so there is no world to simulate; "
                "leave it out"
            )
    result = redecide_recording(bag, _robot(found))
    show_remarks(result)
    modes = Counter(decision.mode.value for decision in result.decided)
    print("modes: " + ", ".join(f"{mode} {count}" for mode, count in sorted(modes.items())))
    print(f"from scratch, {len(result.decided)} decisions, digest {result.digest}")
    if result.faults:
        raise BagError(
            f"{bag}: {len(result.faults)} faults, the first: {result.faults[0]}; see above"
        )
    return 0


def _robot(found: argparse.Namespace) -> Robot:
    from ..ros.node_parameters import VirtualSensorSettings  # a bag of ours does without

    planner, sensor = with_settings(PlannerParams(), SensorParams(), found.settings)
    told = {"robot_radius_m": found.robot_radius, "scan_yaw": found.scan_yaw}
    given = VirtualSensorSettings(**{k: v for k, v in told.items() if v is not None})
    return Robot(
        robot_radius_m=given.robot_radius_m,
        scan_yaw_rad=found.scan_yaw,
        goal=_goal(found.goal),
        scan=found.scan or "",
        odom=found.odom or "",
        planner=planner,
        sensor=sensor,
        seed=found.seed or 0,
    )


def _goal(given: list[float] | None) -> Point | None:
    if given is None:
        return None
    if not all(map(math.isfinite, given)):
        raise ConfigError(f"--goal {given[0]} {given[1]}: not finite; give metres in odom")
    return (given[0], given[1])


def show_remarks(report: Report | Redecided, robot: str = NO_NAMESPACE) -> None:
    """Notes, then faults, not too many of them."""
    for note in report.notes:
        print(of_robot(robot, f"note: {note}"))
    for fault in report.faults[:SHOWN]:
        print(of_robot(robot, f"fault: {fault}"))
    if len(report.faults) > SHOWN:
        print(of_robot(robot, f"fault: ... and {len(report.faults) - SHOWN} more"))
