# SPDX-License-Identifier: Apache-2.0
"""`mfba decide`: decide on the scans and odometry of any recording; needs no ROS without --out."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import BagError
from ..core.output_files import bag_in, refuse_existing
from ..launcher.set_option import (
    METHOD,
    add_set_argument,
    refuse_other,
    with_robot_settings,
    with_settings,
)
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import DEFAULT_METHOD, check_usable, params_for_method
from ..planning.planner_params import Method, PlannerParams
from ..recording.bag_reader import BagReader
from ..simulation.robot_model import Robot
from ..verification.redecide import RecordingDecider, RedecideParams
from .support import recording_arguments
from .support.decided_run import DecidedRun
from .support.verify_foreign_bag import print_lines

_DESCRIPTION = """\
Decide on every scan of a recording with its odometry, as the nodes on that robot would have, and
show the result. The robot moved as recorded, and not as decided. Any rosbag2 or ROS 1 recording
that holds a LaserScan and Odometry is read; the bag is not changed.
"""
_EPILOG = """\
--out makes a run directory: a bag of the inputs and decisions, run.png, report.html, result.json.
`mfba export`, `picture`, `report`, `view`, `digest`, `diff` and `verify` read it as any run's.
"""


def main(args: list[str]) -> int:
    """Decide; return 0 if any scan led to a decision about the way."""
    parser = Parser(prog="mfba decide", description=_DESCRIPTION, epilog=_EPILOG)
    parser.add_bag()
    recording_arguments.add_to(parser)
    parser.add_argument(
        "--speed", type=float, metavar="M/S", help="the same as --set planner.speed_mps=M/S"
    )
    parser.add_argument(
        "--planner",
        choices=[method.value for method in Method],
        help=f"paper: Algorithm 1; predictive: tracks obstacles (default: {DEFAULT_METHOD.value}, "
        "or as the parameter file says)",
    )
    recording_arguments.add_params_file(parser)
    add_set_argument(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="run directory to create")
    parsed = parser.parse(args)
    params = _params(parsed)
    if parsed.out is not None:
        refuse_existing(parsed.out)
    bag = bag_in(parsed.bag)
    with BagReader(bag) as reader:
        reader.check_data()
        for line in reader.left_out:
            print(f"note: left out {line}")
        decider = RecordingDecider(reader, params)
        run = DecidedRun(decider, params, reader, parsed.out)
        run.print_head()
        run.decide_all()
    print_lines("note", decider.notes)
    print_lines("fault", decider.faults)
    run.finish()
    if decider.nothing:
        raise BagError(f"{bag}: {decider.nothing}")
    if decider.faults:
        raise BagError(f"{bag}: {len(decider.faults)} messages were left out; see above")
    return 0


def _params(parsed: argparse.Namespace) -> RedecideParams:
    """Presets of the planner, then the parameter file, then --set and --speed."""
    given = recording_arguments.given_parameters(parsed)
    method = parsed.planner or given.get("planner", {}).get("method")
    planner = params_for_method(method, PlannerParams(), algorithm_1=False)
    planner, sensor = recording_arguments.with_parameters(planner, SensorParams(), given)
    planner = replace(planner, method=Method(method or DEFAULT_METHOD))
    settings = list(parsed.settings)
    if parsed.planner:
        refuse_other(f"--planner {parsed.planner}", f"{METHOD}={parsed.planner}", settings)
    if parsed.speed is not None:
        speed = f"planner.speed_mps={parsed.speed}"
        refuse_other(f"--speed {parsed.speed}", speed, settings)
        settings.append(speed)
    base = {name: getattr(planner, name) for name in Robot().base.__dataclass_fields__}
    robot, others = with_robot_settings(Robot(**base), settings)
    planner, sensor = with_settings(planner, sensor, others)
    planner = planner.for_robot(planner.robot_radius_m, robot.base)
    check_usable(planner)
    return recording_arguments.redecide_params(parsed, planner, sensor, given)
