# SPDX-License-Identifier: Apache-2.0
"""`mfba verify`: whether a bag's decisions are what the planner decides; needs no ROS."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..arguments import Parser
from ..core.episode import Episode
from ..core.errors import BagError, ConfigError
from ..launcher.settings import add_set_argument, with_settings
from ..outputs import bag_in
from ..planners.method import simulate
from ..recording.reader import BagReader
from ..verification.check import Report, verify
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
    report = verify(bag)
    _show(report)
    if not report.is_identical:
        raise BagError(f"{bag}: {_verdict(report)}")
    if found.closed_loop or found.settings:
        recorded = report.setup.episode(report.recorded)
        if found.settings:
            _what_if(recorded, found.settings, found.picture)
        else:
            _closed_loop(bag, recorded)
    return 0


def _show(report: Report) -> None:
    show_remarks(report)
    if report.divergence:
        _show_divergence(report.divergence, "recorded", "decided again")
    elif not report.faults:
        print(f"identical, {len(report.recorded)} decisions, digest {report.digest}")


def _show_divergence(found: Divergence, left: str, right: str) -> None:
    decision = found.left or found.right
    assert decision is not None
    print(f"first difference at tick {found.tick}, stamp {decision.stamp_ns} ns:")
    print("\n".join(side_by_side(found, left, right)))


def _verdict(report: Report) -> str:
    wrong = []
    if report.divergence:
        wrong.append(f"tick {report.divergence.tick} is not what the planner decides")
    if report.faults:
        wrong.append(f"{len(report.faults)} faults, the first: {report.faults[0]}")
    return f"not identical: {'; '.join(wrong)}; see above"


def _again(recorded: Episode, settings: list[str]) -> Episode:
    planner, sensor = with_settings(recorded.planner, recorded.sensor, settings)
    last = recorded.ticks[-1].stamp_ns
    again = simulate(
        recorded.scenario,
        planner=planner,
        sensor=sensor,
        seed=recorded.seed,
        # A recording that was interrupted ends where it ends.
        go_on=lambda world: bool(settings) or world.stamp_ns < last,
    )
    return replace(again, driver="core")


def _closed_loop(bag: Path, recorded: Episode) -> None:
    again = _again(recorded, [])
    found = first_divergence(recorded.ticks, again.ticks)
    if found:
        _show_divergence(found, "recorded", "simulated again")
        raise BagError(
            f"{bag}: tick {found.tick} is not what the simulated world leads to; see above "
            "(a robot that was put elsewhere, or a world that was not simulated, cannot be)"
        )
    print(f"closed loop: identical, {len(again.ticks)} ticks")


def _what_if(recorded: Episode, settings: list[str], picture: Path | None) -> None:
    from ..core.metrics import evaluate
    from ..report.table import comparison_text

    again = _again(recorded, settings)
    change = " ".join(settings)
    print(f"\nwhat if {change}")
    print(comparison_text(("recorded", evaluate(recorded)), ("what if", evaluate(again))))
    found = first_divergence(recorded.ticks, again.ticks)
    if found:
        _show_divergence(found, "recorded", "what if")
    else:
        print("no decision differs")
    if picture:
        from ..report.figure import draw_what_if

        draw_what_if(recorded, again, change, picture)
        print(f"wrote {picture}")
