# SPDX-License-Identifier: Apache-2.0
"""`mfba verify`: whether a bag's decisions are what the planner decides; needs no ROS."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import BagError, ConfigError
from ..core.outputs import bag_in
from ..launcher.set_option import add_set_argument, with_settings
from ..recording.bag_reader import BagReader
from ..recording.read_episode import read_recording
from ..recording.robot_topics import NO_NAMESPACE, of_robot
from ..simulation.episode import Episode, Outcome, stamp_of
from ..simulation.simulate import simulate, simulate_fleet
from ..verification.compare_decisions import Divergence, first_divergence, side_by_side
from ..verification.redecide import is_foreign
from ..verification.verify_bag import Report, verify_each
from . import verify_foreign
from .verify_foreign import show_remarks


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
    verify_foreign.add_arguments(parser)
    found = parser.parse(args)
    bag = bag_in(found.bag)
    with BagReader(bag) as reader:
        if is_foreign(reader):
            return verify_foreign.report(bag, found)
    verify_foreign.refuse_arguments(bag, found)
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
    if found.picture and len(reports) > 1:
        raise ConfigError("--picture: it is of one robot's trails; give --robot NAME as well")
    if found.closed_loop or found.settings:
        for robot, recorded, again in _again(bag, reports, found.settings):
            if found.settings:
                _what_if(robot, recorded, again, found)
            else:
                _closed_loop(bag, robot, recorded, again)
    return 0


def _show(robot: str, report: Report) -> None:
    show_remarks(report, robot)
    if report.divergence:
        _show_divergence(report.divergence, "recorded", "decided again", robot)
    elif not report.faults:
        said = f"identical, {len(report.recorded)} decisions, digest {report.digest}"
        print(of_robot(robot, said))


def _show_divergence(found: Divergence, left: str, right: str, robot: str = NO_NAMESPACE) -> None:
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


def _again(
    bag: Path, reports: dict[str, Report], settings: list[str]
) -> Iterator[tuple[str, Episode, Episode]]:
    """Yield (robot, recorded, simulated again, which is cut short where the recording was)."""
    if NO_NAMESPACE not in reports:
        yield from _fleet_again(bag, reports, settings)
        return
    report = reports[NO_NAMESPACE]
    recorded = report.setup.episode(report.recorded)
    planner, sensor = with_settings(recorded.planner, recorded.sensor, settings)
    again = simulate(
        recorded.scenario,
        planner=planner,
        sensor=sensor,
        seed=recorded.seed,
        go_on=lambda world: bool(settings) or world.stamp_ns < recorded.ticks[-1].stamp_ns,
    )
    yield NO_NAMESPACE, recorded, replace(again, driver="core")


def _fleet_again(
    bag: Path, reports: dict[str, Report], settings: list[str]
) -> Iterator[tuple[str, Episode, Episode]]:
    """All robots at once, since they shared a world; yields those that were asked for."""
    scenario, seed, episodes, _ = read_recording(bag)
    first = next(iter(episodes.values()))
    planner, sensor = with_settings(first.planner, first.sensor, settings)
    last_ns = max(episode.ticks[-1].stamp_ns for episode in episodes.values())
    made = simulate_fleet(
        scenario,
        planner=planner,
        sensor=sensor,
        seed=seed,
        go_on=lambda fleet: bool(settings) or stamp_of(fleet.tick, fleet.tick_ns) < last_ns,
    )
    for (robot, recorded), again in zip(episodes.items(), made):
        if recorded.outcome is Outcome.INTERRUPTED and not settings:
            again = replace(again, ticks=again.ticks[: len(recorded.ticks)])
        if robot in reports:
            yield robot, recorded, replace(again, driver="core")


def _closed_loop(bag: Path, robot: str, recorded: Episode, again: Episode) -> None:
    found = first_divergence(recorded.ticks, again.ticks)
    if found:
        _show_divergence(found, "recorded", "simulated again", robot)
        said = of_robot(robot, f"tick {found.tick} is not what the simulated world leads to")
        raise BagError(
            f"{bag}: {said}; see above "
            "(a robot that was put elsewhere, or a world that was not simulated, cannot be)"
        )
    print(of_robot(robot, f"closed loop: identical, {len(again.ticks)} ticks"))


def _what_if(robot: str, recorded: Episode, again: Episode, given: argparse.Namespace) -> None:
    from ..evaluation.metrics import evaluate
    from ..report.result_table import comparison_text

    change = " ".join(given.settings)
    print(f"\n{of_robot(robot, f'what if {change}')}")
    print(comparison_text(("recorded", evaluate(recorded)), ("what if", evaluate(again))))
    found = first_divergence(recorded.ticks, again.ticks)
    if found:
        _show_divergence(found, "recorded", "what if", robot)
    else:
        print("no decision differs")
    if given.picture:
        from ..report.run_figure import draw_what_if

        draw_what_if(recorded, again, change, given.picture)
        print(f"wrote {given.picture}")
