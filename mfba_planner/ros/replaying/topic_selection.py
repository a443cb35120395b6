# SPDX-License-Identifier: Apache-2.0
"""Selects a bag's topics for replay: name, installed message type and QoS of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile

from ...core.errors import ConfigError, InputError
from ...recording.bag_metadata import BagTopic
from ...recording.message_definitions import definition_of
from ...recording.replay_schedule import merged_qos
from ..interface import qos_conversion as qos
from ..interface import topics
from .replay_arguments import ReplaySettings, known

Resolve = Callable[[str], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayedTopic:
    """One topic of the bag and its publisher's name, type and QoS."""

    recorded: str
    name: str
    type: Any
    qos: QoSProfile
    message_count: int

    @property
    def latched(self) -> bool:
        """Whether late subscribers get the newest messages too."""
        return bool(self.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)


def choose(
    recorded: Mapping[str, BagTopic], settings: ReplaySettings, resolve: Resolve
) -> tuple[list[PlayedTopic], list[str]]:
    """The topics to play, and a line for each that is left out because of its type.

    Raises ConfigError for names that are not in the bag, and when nothing is left.
    """
    new_names = {
        known([resolve(old)], recorded, "--remap")[0]: resolve(new) for old, new in settings.remap
    }
    played, left_out = [], []
    for name in _selected(recorded, settings, resolve):
        topic = recorded[name]
        try:
            message_type = _installed(topic)
        except InputError as error:
            left_out.append(f"left out {name} ({topic.message_count} messages): {error}")
            continue
        played.append(
            PlayedTopic(
                recorded=name,
                name=new_names.get(name, name),
                type=message_type,
                qos=qos.profile(merged_qos(topic.qos)),
                message_count=topic.message_count,
            )
        )
    if not sum(topic.message_count for topic in played):
        raise ConfigError(
            f"{settings.bag}: no message to play{''.join('; ' + line for line in left_out)}; "
            f"topics there: {', '.join(sorted(recorded)) or 'none'}"
        )
    _refuse_clashes(played)
    return played, left_out


def _selected(
    recorded: Mapping[str, BagTopic], settings: ReplaySettings, resolve: Resolve
) -> Iterator[str]:
    only = set(known(map(resolve, settings.topics), recorded, "--topics"))
    if settings.inputs_of:
        only |= {resolve(name) for name in _inputs(settings.inputs_of)}
    never = set(known(map(resolve, settings.exclude), recorded, "--exclude"))
    if settings.clock:
        never.add(topics.CLOCK.name)
    narrowed = settings.topics or settings.inputs_of
    return (name for name in recorded if name not in never and (name in only or not narrowed))


def _inputs(nodes: tuple[str, ...]) -> Iterator[str]:
    """The topics that the nodes read, except those that one of them writes."""
    readers = {name for topic in topics.GRAPH for name in topic.readers}
    chosen = set(known(nodes, readers, "--inputs-of"))
    for topic in topics.GRAPH:
        if chosen.intersection(topic.readers) and not chosen.intersection(topic.writers):
            yield topic.name


def _installed(topic: BagTopic) -> Any:
    """The message class; InputError where it is not installed or differs from the recorded one."""
    # Checked first: a module that a file names is imported only if it is a message type.
    installed = definition_of(topic.type_name).type_hash
    if topic.type_hash.startswith("RIHS01_") and topic.type_hash != installed:
        raise InputError(f"{topic.type_name} was another type when it was recorded")
    package, folder, name = topic.type_name.split("/")
    try:
        return getattr(import_module(f"{package}.{folder}"), name)
    except (ImportError, AttributeError):
        raise InputError(
            f"{topic.type_name}: no Python module; install the ROS 2 package {package}"
        ) from None


def awaited(
    played: list[PlayedTopic], settings: ReplaySettings, resolve: Resolve
) -> dict[str, int] | None:
    """Subscribers that each topic must have before the first message; {}: any topic has one.

    None: wait for no subscriber. Raises ConfigError for a topic that is not played.
    """
    given = settings.wait_for_subscribers
    names = [topic.recorded for topic in played]
    if given is None and not settings.as_fast_as_possible:
        return None
    if given and len(given) == 1 and given[0].isdecimal():
        return dict.fromkeys(names, int(given[0]))
    if given:
        return dict.fromkeys(known(map(resolve, given), names, "--wait-for-subscribers"), 1)
    # Not every planner reads a map, and one that does gets it whenever it subscribes. Where there
    # are scans, the sensor reads these and not the obstacles.
    never = {resolve(topics.MAP.name)}
    if any(
        topic.recorded == resolve(topics.SCAN.name) and topic.message_count for topic in played
    ):
        never.add(resolve(topics.OBSTACLES.name))
    needed = [name for name in names if name not in never]
    return dict.fromkeys(needed, 1) if settings.inputs_of else {}


def _refuse_clashes(played: list[PlayedTopic]) -> None:
    by_name: dict[str, PlayedTopic] = {}
    for topic in played:
        other = by_name.setdefault(topic.name, topic)
        if other.type is not topic.type:
            raise ConfigError(
                f"--remap: {other.recorded} and {topic.recorded} would both be {topic.name}, but "
                "their types differ; choose another name"
            )
