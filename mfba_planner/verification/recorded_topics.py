# SPDX-License-Identifier: Apache-2.0
"""Which topics of a foreign recording belong together: those of one robot.

A topic without messages counts as not recorded. Of several the one is taken whose namespace is
nearest to that of the scan; goals, maps and transforms are never those of another namespace.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import takewhile

from ..core.errors import BagError
from ..recording.bag_reader import BagReader

Namespace = tuple[str, ...]
_SEVERAL = {"--scan": ", or the lidars of one robot, separated by commas"}


def namespace(topic: str) -> Namespace:
    """The namespace of a topic, name by name; () at the root."""
    return tuple(topic.strip("/").split("/")[:-1])


def recorded(reader: BagReader, type_name: str) -> list[str]:
    """The topics of a type that have messages, sorted."""
    return sorted(
        name
        for name, topic in reader.topics.items()
        if topic.type_name == type_name and topic.message_count
    )


def named_or_only(
    reader: BagReader, type_name: str, wanted: str, option: str, near: str = ""
) -> str:
    """The topic of a type that is wanted, the only one, or that nearest to another topic.

    The sectors of our own virtual_sensor are scans too, and only taken if wanted. Raises BagError
    where that is none, or more than one.
    """
    found = recorded(reader, type_name)
    if wanted in found:
        return wanted
    if not wanted:
        found = [name for name in found if not _is_of_virtual_sensor(reader, name)] or found
    if wanted:
        known = reader.topics.get(wanted)
        problem = "no such topic" if known is None else "has no message"
        if known is not None and known.type_name != type_name:
            problem = f"of type {known.type_name}, not {type_name}"
        remedy = f"give one of {', '.join(found)}" if found else f"it has none of {type_name}"
        raise BagError(f"{reader.path}: {option} {wanted}: {problem}; {remedy}")
    if not found:
        raise BagError(
            f"{reader.path}: no message of type {type_name}; give a recording that holds some"
        )
    nearest = _nearest(found, near) if near else found
    if len(nearest) > 1:
        raise BagError(
            f"{reader.path}: {len(found)} topics of {type_name}, {', '.join(found)}; "
            f"name one with {option}{_SEVERAL.get(option, '')}"
        )
    return nearest[0]


def _is_of_virtual_sensor(reader: BagReader, name: str) -> bool:
    above, _, last = name.rpartition("/")
    return last == "sectors" and f"{above}/sensory_vector" in reader.topics


def require_same_robot(reader: BagReader, type_name: str, scan: str, odom: str) -> None:
    """Raise BagError if the odometry is in the namespace of another topic of the scan's type."""
    own = _common((namespace(scan), namespace(odom)))
    others = (_common((namespace(name), namespace(odom))) for name in recorded(reader, type_name))
    if any(len(other) > len(own) for other in others):
        raise BagError(
            f"{reader.path}: {odom} is not in the namespace of {scan}; if it belongs to that "
            f"robot, name it with --odom {odom}"
        )


def of_robot(topics: Iterable[str], name: str, robot: Sequence[str]) -> list[str]:
    """The topics with this last name that belong to the robot with these other topics.

    Those in the nearest namespace around one of its topics; else those below all of its topics.
    """
    spaces = [namespace(topic) for topic in robot]
    found = [topic for topic in topics if topic.strip("/").split("/")[-1] == name]
    around = {
        topic: len(namespace(topic))
        for topic in found
        if any(space[: len(namespace(topic))] == namespace(topic) for space in spaces)
    }
    if around:
        return [topic for topic, depth in around.items() if depth == max(around.values())]
    common = _common(spaces)
    return [topic for topic in found if namespace(topic)[: len(common)] == common and common]


def _nearest(topics: list[str], near: str) -> list[str]:
    """Those that share the most of their namespace with another topic."""
    shared = {topic: len(_common((namespace(topic), namespace(near)))) for topic in topics}
    return [topic for topic, depth in shared.items() if depth == max(shared.values())]


def _common(spaces: Iterable[Namespace]) -> Namespace:
    """The namespace around all of these."""
    return tuple(level[0] for level in takewhile(lambda names: len(set(names)) == 1, zip(*spaces)))
