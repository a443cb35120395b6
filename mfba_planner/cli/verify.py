# SPDX-License-Identifier: Apache-2.0
"""`mfba verify`: recompute a bag's decisions and compare bit for bit; needs no ROS."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import BagError, ConfigError
from ..core.output_files import bag_in, file_type
from ..launcher.set_option import add_set_argument, with_settings
from ..recording.bag_reader import BagReader
from ..recording.configuration_attachment import has_configuration
from ..recording.fleet_topics import NO_NAMESPACE, with_robot_name
from ..recording.read_episode import read_recording
from ..recording.run_parameters import Nodes
from ..simulation.episode import Episode, Outcome, stamp_of
from ..simulation.run_episode import simulate, simulate_fleet
from ..verification.compare_decisions import Divergence, first_divergence, side_by_side
from ..verification.redecide import is_foreign
from ..verification.verify_bag import Report, verify_each
from .support import recording_arguments, verify_foreign_bag
from .support.progress_bar import progress_bar
from .support.verify_foreign_bag import print_remarks


def main(args: list[str]) -> int:
    """Verify a bag; return 0 when all decisions are identical."""
    parser = Parser(
        prog="mfba verify",
        description="Recompute the decisions, without ROS, from recorded odometry and sectors, "
        "and compare them bit for bit with the recorded ones. The bag is not changed.",
    )
    parser.add_bag()
    parser.add_robots()
    parser.add_argument("--closed-loop", action="store_true", help="also simulate the world again")
    parser.add_argument(
        "--allow-modules", action="store_true",
        help="import an optimizer MODULE:NAME that the bag names",
    )  # fmt: skip
    add_set_argument(parser)
    parser.add_argument(
        "--picture", type=file_type("picture", ".png"), metavar="PNG",
        help="with --set: file to create, with both trails",
    )  # fmt: skip
    verify_foreign_bag.add_arguments(parser)
    recording_arguments.add_params_file(parser)
    parsed = parser.parse(args)
    bag = bag_in(parsed.bag)
    with BagReader(bag) as reader:
        if is_foreign(reader):
            return verify_foreign_bag.report(bag, parsed)
    verify_foreign_bag.refuse_arguments(bag, parsed)
    if parsed.picture and not parsed.settings:
        raise ConfigError("--picture: there is one trail only; give --set NAME=VALUE as well")
    given = _given(bag, parsed)
    with progress_bar("deciding again") as show:
        reports = verify_each(
            bag, parsed.robots, allow_modules=parsed.allow_modules, given=given, progress=show
        )
    for robot, report in reports.items():
        _print_report(robot, report)
    failures = [
        _verdict(robot, report) for robot, report in reports.items() if not report.is_identical
    ]
    if failures:
        more = f" (and {len(failures) - 1} more robots)" if failures[1:] else ""
        raise BagError(f"{bag}: {failures[0]}{more}; see above")
    if parsed.picture and len(reports) > 1:
        raise ConfigError("--picture: it is of one robot's trails; give --robot NAME as well")
    if parsed.closed_loop or parsed.settings:
        for robot, recorded, simulated in _simulate_again(bag, reports, parsed.settings):
            if parsed.settings:
                _compare_what_if(robot, recorded, simulated, parsed)
            else:
                _compare_closed_loop(bag, robot, recorded, simulated)
    return 0


def _given(bag: Path, parsed: argparse.Namespace) -> Nodes | None:
    """The parameters of --params-file, None where the bag has its own. Raises ConfigError."""
    if parsed.params_file is None:
        return None
    with BagReader(bag) as reader:
        if has_configuration(reader):
            raise ConfigError(
                f"--params-file {parsed.params_file}: {bag} contains its parameters already; "
                "leave it out"
            )
    return recording_arguments.given_parameters(parsed)


def _print_report(robot: str, report: Report) -> None:
    print_remarks(report, robot)
    if report.divergence:
        _print_divergence(report.divergence, "recorded", "recomputed", robot)
    elif not report.faults:
        text = f"identical, {len(report.recorded)} decisions, digest {report.digest}"
        print(with_robot_name(robot, text))


def _print_divergence(
    divergence: Divergence, left: str, right: str, robot: str = NO_NAMESPACE
) -> None:
    decision = divergence.left or divergence.right
    assert decision is not None
    text = f"first difference at tick {divergence.tick}, stamp {decision.stamp_ns} ns:"
    print(with_robot_name(robot, text))
    print("\n".join(side_by_side(divergence, left, right)))


def _verdict(robot: str, report: Report) -> str:
    failures = []
    if report.divergence:
        failures.append(f"tick {report.divergence.tick} is not what the planner decides")
    if report.faults:
        failures.append(f"{len(report.faults)} faults, the first: {report.faults[0]}")
    return with_robot_name(robot, f"not identical: {'; '.join(failures)}")


def _simulate_again(
    bag: Path, reports: dict[str, Report], settings: list[str]
) -> Iterator[tuple[str, Episode, Episode]]:
    """Yield (robot, recorded, simulated again); the simulation ends where the recording does."""
    if NO_NAMESPACE not in reports:
        yield from _simulate_fleet_again(bag, reports, settings)
        return
    report = reports[NO_NAMESPACE]
    recorded = report.setup.episode(report.recorded)
    planner, sensor = with_settings(recorded.planner, recorded.sensor, settings)
    simulated = simulate(
        recorded.scenario,
        planner=planner,
        sensor=sensor,
        seed=recorded.seed,
        go_on=lambda world: bool(settings) or world.stamp_ns < recorded.ticks[-1].stamp_ns,
    )
    yield NO_NAMESPACE, recorded, replace(simulated, driver="core")


def _simulate_fleet_again(
    bag: Path, reports: dict[str, Report], settings: list[str]
) -> Iterator[tuple[str, Episode, Episode]]:
    """Simulate all robots, since they share a world; yield the requested ones."""
    scenario, seed, episodes, _ = read_recording(bag)
    first = next(iter(episodes.values()))
    planner, sensor = with_settings(first.planner, first.sensor, settings)
    last_ns = max(episode.ticks[-1].stamp_ns for episode in episodes.values())
    fleet = simulate_fleet(
        scenario,
        planner=planner,
        sensor=sensor,
        seed=seed,
        go_on=lambda world: bool(settings) or stamp_of(world.tick, world.tick_ns) < last_ns,
    )
    for (robot, recorded), simulated in zip(episodes.items(), fleet):
        if recorded.outcome is Outcome.INTERRUPTED and not settings:
            simulated = replace(simulated, ticks=simulated.ticks[: len(recorded.ticks)])
        if robot in reports:
            yield robot, recorded, replace(simulated, driver="core")


def _compare_closed_loop(bag: Path, robot: str, recorded: Episode, simulated: Episode) -> None:
    divergence = first_divergence(recorded.ticks, simulated.ticks)
    if divergence:
        _print_divergence(divergence, "recorded", "simulated again", robot)
        text = with_robot_name(robot, f"tick {divergence.tick} differs from the simulated world")
        raise BagError(
            f"{bag}: {text}; see above "
            "(expected if the robot was moved or the recorded world was not simulated)"
        )
    print(with_robot_name(robot, f"closed loop: identical, {len(simulated.ticks)} ticks"))


def _compare_what_if(
    robot: str, recorded: Episode, simulated: Episode, parsed: argparse.Namespace
) -> None:
    from ..evaluation.metrics import evaluate
    from ..report.result_table import comparison_text

    change = " ".join(parsed.settings)
    print(f"\n{with_robot_name(robot, f'what if {change}')}")
    print(comparison_text(("recorded", evaluate(recorded)), ("what if", evaluate(simulated))))
    divergence = first_divergence(recorded.ticks, simulated.ticks)
    if divergence:
        _print_divergence(divergence, "recorded", "what if", robot)
    else:
        print("no decision differs")
    if parsed.picture:
        from ..report.run_figure import draw_what_if

        draw_what_if(recorded, simulated, change, parsed.picture)
        print(f"wrote {parsed.picture}")
