# SPDX-License-Identifier: Apache-2.0
"""`mfba verify`: whether a bag's decisions are what the planner decides; needs no ROS."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..arguments import Parser
from ..core.episode import Episode, Outcome
from ..core.errors import BagError, ConfigError
from ..launcher.settings import add_set_argument, with_settings
from ..outputs import bag_in
from ..planners.method import simulate, simulate_fleet
from ..recording.episode import read_recording
from ..recording.reader import BagReader
from ..recording.robots import ALONE, of_robot
from ..verification.check import Report, verify_each
from ..verification.compare import Divergence, first_divergence, side_by_side
from ..verification.scratch import is_foreign
from . import from_scratch
from .from_scratch import show_remarks


def main(args: list[str]) -> int:
    """Check a bag; 0 when all is identical."""
    parser = Parser(
        prog="mfba verify",
        description="Decide again, without ROS, on the odometry and sectors a bag recorded, and "
        "compare with the recorded decisions bit for bit. Nothing is written into the bag.",
    )
    parser.add_bag()
    parser.add_robots()
    parser.add_argument(
        "--closed-loop", action="store_true", help="simulate the world again as well"
    )
    add_set_argument(parser)
    parser.add_argument(
        "--picture", type=Path, metavar="PNG", help="with --set: both trails, a file to create"
    )
    from_scratch.add_arguments(parser)
    found = parser.parse(args)
    bag = bag_in(found.bag)
    with BagReader(bag) as reader:
        if is_foreign(reader):
            return from_scratch.report(bag, found)
    from_scratch.refuse_arguments(bag, found)
    if found.picture and not found.settings:
        raise ConfigError("--picture: there is one trail only; give --set NAME=VALUE as well")
    reports = verify_each(bag, found.robots)
    for robot, report in reports.items():
        _show(robot, report)
    wrong = [
        _verdict(robot, report) for robot, report in reports.items() if not report.is_identical
    ]
    if wrong:
        more = f" (and {len(wrong) - 1} more robots)" if wrong[1:] else ""
        raise BagError(f"{bag}: {wrong[0]}{more}; see above")
    if ALONE not in reports:
        if found.closed_loop or found.settings:
            _fleet_again(bag, found)
    elif found.closed_loop or found.settings:
        report = reports[ALONE]
        recorded = report.setup.episode(report.recorded)
        if found.settings:
            _what_if(recorded, _again(recorded, found.settings), found)
        else:
            _closed_loop(bag, recorded, _again(recorded, []))
    return 0


def _show(robot: str, report: Report) -> None:
    show_remarks(report, robot)
    if report.divergence:
        _show_divergence(report.divergence, "recorded", "decided again", robot)
    elif not report.faults:
        said = f"identical, {len(report.recorded)} decisions, digest {report.digest}"
        print(of_robot(robot, said))


def _show_divergence(found: Divergence, left: str, right: str, robot: str = ALONE) -> None:
    decision = found.left or found.right
    assert decision is not None
    said = f"first difference at tick {found.tick}, stamp {decision.stamp_ns} ns:"
    print(of_robot(robot, said))
    print("\n".join(side_by_side(found, left, right)))


def _verdict(robot: str, report: Report) -> str:
    wrong = []
    if report.divergence:
        wrong.append(f"tick {report.divergence.tick} is not what the planner decides")
    if report.faults:
        wrong.append(f"{len(report.faults)} faults, the first: {report.faults[0]}")
    return of_robot(robot, f"not identical: {'; '.join(wrong)}")


def _again(recorded: Episode, settings: list[str]) -> Episode:
    again = simulate(
        recorded.scenario,
        **_told(recorded, settings),
        seed=recorded.seed,
        # A recording that was interrupted ends where it ends.
        go_on=lambda world: bool(settings) or world.stamp_ns < recorded.ticks[-1].stamp_ns,
    )
    return replace(again, driver="core")


def _told(recorded: Episode, settings: list[str]) -> dict[str, Any]:
    planner, sensor = with_settings(recorded.planner, recorded.sensor, settings)
    return {"planner": planner, "sensor": sensor}


def _fleet_again(bag: Path, found: argparse.Namespace) -> None:
    """Closed loop or what if of all robots of a fleet at once, as they shared a world."""
    recording = read_recording(bag)
    recorded, settings = recording.episodes, found.settings
    names = list(recorded)
    wanted = found.robots or names
    if found.picture and len(wanted) > 1:
        raise ConfigError("--picture: it is of one robot's trails; give --robot NAME as well")
    last = max(episode.ticks[-1].stamp_ns for episode in recorded.values())
    made = simulate_fleet(
        recording.scenario,
        **_told(recorded[names[0]], settings),
        seed=recording.seed,
        go_on=lambda fleet: bool(settings) or (fleet.tick + 1) * fleet.tick_ns < last,
    )
    again = dict(zip(names, made))
    for name in wanted:
        if settings:
            _what_if(recorded[name], again[name], found, name)
        else:
            # A recording that was interrupted ends where it ends, each robot's at its own tick.
            asked = recorded[name].ticks if recorded[name].outcome is Outcome.INTERRUPTED else None
            ticks = again[name].ticks[: len(asked) if asked else None]
            _closed_loop(bag, recorded[name], replace(again[name], ticks=ticks), name)


def _closed_loop(bag: Path, recorded: Episode, again: Episode, robot: str = ALONE) -> None:
    found = first_divergence(recorded.ticks, again.ticks)
    if found:
        _show_divergence(found, "recorded", "simulated again", robot)
        said = of_robot(robot, f"tick {found.tick} is not what the simulated world leads to")
        raise BagError(
            f"{bag}: {said}; see above "
            "(a robot that was put elsewhere, or a world that was not simulated, cannot be)"
        )
    print(of_robot(robot, f"closed loop: identical, {len(again.ticks)} ticks"))


def _what_if(
    recorded: Episode, again: Episode, given: argparse.Namespace, robot: str = ALONE
) -> None:
    from ..core.metrics import evaluate
    from ..report.table import comparison_text

    change = " ".join(given.settings)
    print(f"\n{of_robot(robot, f'what if {change}')}")
    print(comparison_text(("recorded", evaluate(recorded)), ("what if", evaluate(again))))
    found = first_divergence(recorded.ticks, again.ticks)
    if found:
        _show_divergence(found, "recorded", "what if")
    else:
        print("no decision differs")
    if given.picture:
        from ..report.figure import draw_what_if

        draw_what_if(recorded, again, change, given.picture)
        print(f"wrote {given.picture}")
