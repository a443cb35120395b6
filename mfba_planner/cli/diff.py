# SPDX-License-Identifier: Apache-2.0
"""`mfba diff`: where the decisions of two bags first differ; needs no ROS."""

from __future__ import annotations

import argparse

from ..core.argument_parser import Parser
from ..core.errors import BagError
from ..core.options import flatten
from ..core.outputs import bag_in
from ..evaluation.metrics import evaluate
from ..recording.omitted_decisions import tell
from ..recording.read_episode import Recording, read_recording
from ..recording.robot_topics import of_robot
from ..report.result_table import comparison_text
from ..simulation.decision_digest import digest
from ..simulation.episode import Episode
from ..verification.compare_decisions import first_divergence, side_by_side


def main(args: list[str]) -> int:
    """Compare two bags; 0 when all decisions are equal, 1 when not, as diff does.

    Decisions that one bag has and cannot show, and the other has not, are not equal.
    """
    parser = Parser(prog="mfba diff", description="Say where the decisions of two bags differ.")
    for name in ("left", "right"):
        parser.add_bag(name)
    parser.add_robots()
    given = parser.parse(args)
    bags = [bag_in(path) for path in (given.left, given.right)]
    one, other = (read_recording(bag, given.robots) for bag in bags)
    if one.episodes.keys() != other.episodes.keys():
        raise BagError(
            f"{given.right}: holds other robots than {given.left}; name one that both have with "
            "--robot"
        )
    tell(bags[0], one.missed)
    tell(bags[1], other.missed)
    differ = [_compare(given, robot, one, other) for robot in one.episodes]
    return int(any(differ))


def _compare(given: argparse.Namespace, robot: str, one: Recording, other: Recording) -> bool:
    """Print how two runs of a robot differ; whether they do."""
    left, right = one.episodes[robot], other.episodes[robot]
    found = first_divergence(left.ticks, right.ticks)
    if found is None:
        alike = one.missed.get(robot) == other.missed.get(robot)
        said = f"{len(left.ticks)} decisions, digest {digest(left.ticks)}"
        how = "identical" if alike else "identical but for what is left out"
        print(of_robot(robot, f"{how}, {said}"))
        return not alike
    for name, a, b in _settings(left, right):
        print(of_robot(robot, f"{name}: {a} against {b}"))
    names = (str(given.left), str(given.right))
    print(comparison_text((names[0], evaluate(left)), (names[1], evaluate(right))))
    print(of_robot(robot, f"first difference at tick {found.tick}:"))
    print("\n".join(side_by_side(found, *names)))
    return True


def _settings(left: Episode, right: Episode) -> list[tuple[str, object, object]]:
    """What was set differently."""
    rows: list[tuple[str, object, object]] = []
    for group in ("planner", "sensor"):
        a, b = (flatten(getattr(episode, group)) for episode in (left, right))
        rows += [(f"{group}.{name}", a[name], b[name]) for name in a if a[name] != b[name]]
    if left.seed != right.seed:
        rows.append(("seed", left.seed, right.seed))
    if left.scenario != right.scenario:
        rows.append(("scenario", left.scenario.name, right.scenario.name))
    return rows
