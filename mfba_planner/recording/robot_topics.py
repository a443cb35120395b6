# SPDX-License-Identifier: Apache-2.0
"""Whose messages are whose: who is alone has its topics at the root, others below their names.

A robot is called by its name, one that is alone ALONE. What it said is handed out under the
topic's name at the root, so that nobody else needs to know of namespaces.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from ..core.errors import BagError
from ..core.options import did_you_mean
from .bag_reader import BagReader, DecodedMessage

NO_NAMESPACE = ""


def below(robot: str, topic: str) -> str:
    """The name of a robot's topic in a bag, from its name at the root."""
    return f"/{robot}{topic}" if robot else topic


def messages_by_robot(
    reader: BagReader, robots: Sequence[str], topics: Collection[str]
) -> Iterator[tuple[str, DecodedMessage]]:
    """Yield (robot, message under its topic's name at the root) in one pass, by log time."""
    owners = {below(robot, topic): (robot, topic) for robot in robots for topic in topics}
    for message in reader.decoded(owners):
        robot, topic = owners[message.topic]
        yield robot, message._replace(topic=topic)


def chosen(path: Path, robots: Sequence[str], wanted: Sequence[str]) -> tuple[str, ...]:
    """The wanted ones of a bag's robots, all where none is named. BagError for one not there."""
    for name in wanted:
        if NO_NAMESPACE in robots:
            raise BagError(f"{path}: holds one robot's run, and no {name}; leave out --robot")
        if name not in robots:
            raise BagError(f"{path}: holds no robot {name}; {did_you_mean(name, list(robots))}")
    return tuple(name for name in robots if name in wanted) if wanted else tuple(robots)


def of_robot(robot: str, said: str) -> str:
    """A line about a robot of a bag; of one that is alone it needs no name."""
    return f"{robot}: {said}" if robot else said
