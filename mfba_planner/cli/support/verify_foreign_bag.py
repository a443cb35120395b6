# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba verify`, not a command: recordings of other programs (LaserScan, Odometry)."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ...core.errors import BagError, ConfigError
from ...launcher.set_option import with_settings
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ...recording.fleet_topics import NO_NAMESPACE, with_robot_name
from ...verification.redecide import RedecideParams, RedecideResult, redecide_recording
from ...verification.verify_bag import Report
from . import recording_arguments

SHOWN = 10  # faults printed at most
_NEEDS_OWN_BAG = {"closed_loop": "--closed-loop", "picture": "--picture", "robots": "--robot"}
_FOREIGN_ONLY = recording_arguments.NAMES


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for what such a recording does not contain."""
    group = parser.add_argument_group(
        "a recording of a LaserScan and Odometry, not made by mfba",
        "It has no decisions to compare with: prints the computed decisions' digest. "
        "`mfba decide` shows them.",
    )
    recording_arguments.add_to(group)


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
    result = redecide_recording(bag, _params(parsed))
    print_remarks(result)
    modes = Counter(decision.mode.value for decision in result.decided)
    print("modes: " + ", ".join(f"{mode} {count}" for mode, count in sorted(modes.items())))
    print(f"computed: {len(result.decided)} decisions, digest {result.digest}")
    if result.faults:
        raise BagError(
            f"{bag}: {len(result.faults)} faults, the first: {result.faults[0]}; see above"
        )
    if result.nothing:
        raise BagError(f"{bag}: {result.nothing}")
    return 0


def _params(parsed: argparse.Namespace) -> RedecideParams:
    given = recording_arguments.given_parameters(parsed)
    planner, sensor = recording_arguments.with_parameters(PlannerParams(), SensorParams(), given)
    planner, sensor = with_settings(planner, sensor, parsed.settings)
    return recording_arguments.redecide_params(parsed, planner, sensor, given)


def print_remarks(report: Report | RedecideResult, robot: str = NO_NAMESPACE) -> None:
    """Print the notes, then at most SHOWN faults."""
    for note in report.notes:
        print(with_robot_name(robot, f"note: {note}"))
    print_lines("fault", report.faults, robot)


def print_lines(kind: str, lines: Sequence[str], robot: str = NO_NAMESPACE) -> None:
    """Print at most SHOWN lines, and how many more there are."""
    for line in lines[:SHOWN]:
        print(with_robot_name(robot, f"{kind}: {line}"))
    if len(lines) > SHOWN:
        print(with_robot_name(robot, f"{kind}: ... and {len(lines) - SHOWN} more"))
