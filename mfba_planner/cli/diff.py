# SPDX-License-Identifier: Apache-2.0
"""`mfba diff`: first difference between the decisions of two bags; needs no ROS."""

from __future__ import annotations

import argparse

from ..core.argument_parser import Parser
from ..core.errors import BagError
from ..core.option_specs import flatten
from ..core.output_files import bag_in
from ..evaluation.metrics import evaluate
from ..recording.decisions_without_inputs import print_omissions
from ..recording.fleet_topics import with_robot_name
from ..recording.read_episode import Recording, read_recording
from ..report.result_table import comparison_text
from ..simulation.decision_digest import digest
from ..simulation.episode import Episode
from ..simulation.triggers import before_triggers
from ..verification.compare_decisions import first_divergence, side_by_side


def main(args: list[str]) -> int:
    """Compare two bags; return 0 when all decisions are equal, else 1, like diff.

    Decisions left out of one bag only count as a difference.
    """
    parser = Parser(prog="mfba diff", description="Print where the decisions of two bags differ.")
    for name in ("left", "right"):
        parser.add_bag(name)
    parser.add_robots()
    parsed = parser.parse(args)
    bags = [bag_in(path) for path in (parsed.left, parsed.right)]
    left_recording, right_recording = (read_recording(bag, parsed.robots) for bag in bags)
    if left_recording.episodes.keys() != right_recording.episodes.keys():
        raise BagError(
            f"{parsed.right}: holds other robots than {parsed.left}; name one that both have with "
            "--robot"
        )
    print_omissions(bags[0], left_recording.omitted)
    print_omissions(bags[1], right_recording.omitted)
    differ = [
        _compare(parsed, robot, left_recording, right_recording)
        for robot in left_recording.episodes
    ]
    return int(any(differ))


def _compare(
    parsed: argparse.Namespace, robot: str, left_recording: Recording, right_recording: Recording
) -> bool:
    """Print how two runs of a robot differ; return whether they do."""
    left, right = left_recording.episodes[robot], right_recording.episodes[robot]
    divergence = first_divergence(left.ticks, right.ticks)
    if divergence is None:
        same_omissions = left_recording.omitted.get(robot) == right_recording.omitted.get(robot)
        text = f"{len(left.ticks)} decisions, digest {digest(left.ticks)}"
        verdict = "identical" if same_omissions else "identical but for what is left out"
        print(with_robot_name(robot, f"{verdict}, {text}"))
        return not same_omissions
    for name, a, b in _settings(left, right):
        print(with_robot_name(robot, f"{name}: {a} against {b}"))
    names = (str(parsed.left), str(parsed.right))
    print(comparison_text((names[0], evaluate(left)), (names[1], evaluate(right))))
    print(with_robot_name(robot, f"first difference at tick {divergence.tick}:"))
    print("\n".join(side_by_side(divergence, *names)))
    return True


def _settings(left: Episode, right: Episode) -> list[tuple[str, object, object]]:
    """(name, left, right) of each parameter, seed or scenario that differs."""
    rows: list[tuple[str, object, object]] = []
    for group in ("planner", "sensor"):
        a, b = (flatten(getattr(episode, group)) for episode in (left, right))
        rows += [(f"{group}.{name}", a[name], b[name]) for name in a if a[name] != b[name]]
    if left.seed != right.seed:
        rows.append(("seed", left.seed, right.seed))
    if before_triggers(left.scenario) != before_triggers(right.scenario):
        rows.append(("scenario", left.scenario.name, right.scenario.name))
    return rows
