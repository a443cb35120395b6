# SPDX-License-Identifier: Apache-2.0
"""Decisions at the end of a bag whose inputs never came into it: what is said of them.

A node that is killed takes with it what it had sent but not yet delivered to everybody: the
planner may have answered what the recorder never got. Such a bag is read without the decisions
that came after the end of their inputs' topic. An input that lacks before that end is a hole, and
is refused.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TextIO

from .robot_topics import of_robot


def left_out(stamps: Collection[int], topics: Collection[str]) -> str:
    """What is said of decisions under these stamps, in ns, that came after the topics' end."""
    last = "decision" if len(stamps) == 1 else f"{len(stamps)} decisions"
    return (
        f"left out the last {last}, from stamp {min(stamps)} ns on: "
        f"{', '.join(topics)} ended before (a node that was killed?)"
    )


def tell(path: Path, said: Mapping[str, str], file: TextIO | None = None) -> None:
    """Print a line for each robot of a bag of which something is left out ("": nothing is)."""
    for robot, what in said.items():
        if what:
            print(f"note: {path}: {of_robot(robot, what)}", file=file)
