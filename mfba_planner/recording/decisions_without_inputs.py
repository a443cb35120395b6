# SPDX-License-Identifier: Apache-2.0
"""Notes about omitted decisions: those at both ends of a bag whose inputs were not recorded.

A node that is killed loses messages it sent but did not deliver to all subscribers: the planner
may have received an input that the recorder did not. A recorder that starts while the graph runs
finds the topics one after another. Decisions before the first and after the last message of their
input's topic are therefore omitted. An input that is missing in between is an error of the bag.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TextIO

from .fleet_topics import with_robot_name

_DECISIONS = "/planner/decision"


def omission_text(stamps: Collection[int], topics: Collection[str]) -> str:
    """The note about decisions with these stamps, in ns, after the last message of the topics."""
    last = "decision" if len(stamps) == 1 else f"{len(stamps)} decisions"
    return (
        f"left out the last {last}, from stamp {min(stamps)} ns on: "
        f"{', '.join(topics)} ended before (was a node killed?)"
    )


def ragged_begin_text(stamps: Collection[int], topics: Collection[str]) -> str:
    """The note about decisions with these stamps, in ns, before the topics' first message."""
    first = "decision" if len(stamps) == 1 else f"{len(stamps)} decisions"
    return (
        f"left out the first {first}, up to stamp {max(stamps)} ns: "
        f"{', '.join(topics)} began later (was the recorder started while the graph ran?)"
    )


def undecided_text(count: int) -> str:
    """The note about sectors before the first decision of a recording."""
    return (
        f"the first {count} sectors have no decision: {_DECISIONS} began later "
        "(was the recorder started while the graph ran?)"
    )


def print_omissions(path: Path, omissions: Mapping[str, str], file: TextIO | None = None) -> None:
    """Print the note of each robot of a bag, from the notes by robot ("": nothing to print)."""
    for robot, text in omissions.items():
        if text:
            print(f"note: {path}: {with_robot_name(robot, text)}", file=file)
