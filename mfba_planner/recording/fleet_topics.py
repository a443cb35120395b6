# SPDX-License-Identifier: Apache-2.0
"""Topic names of each robot in a bag: at the root for a single robot, else in its namespace.

A robot is identified by its name, a single robot by NO_NAMESPACE. Messages are returned with the
topic name at the root, so that readers need no namespaces.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.errors import BagError
from ..core.option_specs import did_you_mean

if TYPE_CHECKING:
    from .bag_reader import BagReader, DecodedMessage

NO_NAMESPACE = ""


def robot_topic(robot: str, topic: str) -> str:
    """The full name of a robot's topic in a bag, from its name at the root."""
    return f"/{robot}{topic}" if robot else topic


def messages_by_robot(
    reader: BagReader, robots: Sequence[str], topics: Collection[str]
) -> Iterator[tuple[str, DecodedMessage]]:
    """Yield (robot, message with its topic name at the root) in one pass, by log time."""
    robot_topics = {
        robot_topic(robot, topic): (robot, topic) for robot in robots for topic in topics
    }
    for message in reader.decoded(robot_topics):
        robot, topic = robot_topics[message.topic]
        yield robot, message._replace(topic=topic)


def select_robots(path: Path, robots: Sequence[str], wanted: Sequence[str]) -> tuple[str, ...]:
    """The wanted robots of a bag, all if none is named. BagError for an unknown robot."""
    for name in wanted:
        if NO_NAMESPACE in robots:
            raise BagError(f"{path}: holds one robot's run, and no {name}; leave out --robot")
        if name not in robots:
            raise BagError(f"{path}: holds no robot {name}; {did_you_mean(name, list(robots))}")
    return tuple(name for name in robots if name in wanted) if wanted else tuple(robots)


def with_robot_name(robot: str, text: str) -> str:
    """A line of text with the robot's name in front; unchanged for a single robot."""
    return f"{robot}: {text}" if robot else text
