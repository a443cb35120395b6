# SPDX-License-Identifier: Apache-2.0
"""Record a bag of a real run, and make edited copies of it."""

import json
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import claim_domain
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.configuration_attachment import (
    attach_configuration,
    read_configuration,
)
from mfba_planner.recording.merge_by_time import RawMessage
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.qos_conversion import offered
from mfba_planner.ros.interface.serialized_message import type_name
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario


def record(directory: Path, scenario: str, seed: int) -> Path:
    """Record a run of a scenario (name or text) in its own ROS domain; return the bag."""
    domain, lock = claim_domain()
    config = RunConfig(scenario=load_scenario(scenario), driver=Driver.IN_PROCESS, seed=seed)
    with lock:
        run_in_process(config, directory, domain_id=domain)
    return directory


KINDS = {f"/{topic.name.lstrip('/')}": topic.type for topic in topics.GRAPH}


def kind_of(topic: str) -> Any:
    """The message class of a topic, with or without a robot's namespace."""
    return KINDS.get(topic) or KINDS["/" + topic.split("/", 2)[2]]


Edit = Callable[[list[RawMessage]], Iterable[RawMessage]]


def rewrite(
    bag: Path, out: Path, edit: Edit, *, configure: Callable[[Any], Any] = lambda content: content
) -> Path:
    """A complete bag with edited messages and configuration (None: without)."""
    with BagReader(bag) as reader, BagWriter(out) as writer:
        for topic in reader.topics.values():
            writer.add_topic(topic.name, topic.type_name, topic.qos)
        known = set(reader.topics)
        content = configure(read_configuration(reader))
        if content is not None:
            attach_configuration(writer, content)
        for message in edit(list(reader.messages())):
            if message.topic not in known:
                known.add(message.topic)
                kind = type_name(kind_of(message.topic))
                writer.add_topic(message.topic, kind, offered(topics.VIEW_QOS))
            writer.write(message.topic, message.data, message.log_time_ns, message.publish_time_ns)
    return out


def changed(message: RawMessage, change: Callable[[Any], None]) -> RawMessage:
    """The message after `change` was applied to it."""
    decoded = deserialize_message(message.data, kind_of(message.topic))
    change(decoded)
    return message._replace(data=serialize_message(decoded))


def parameter_set(node: str, name: str, value: Any) -> Edit:
    """Edit: the node publishes its parameters again at the end, one of them changed."""

    def edit(messages: list[RawMessage]) -> list[RawMessage]:
        (first,) = (m for m in messages if m.topic == f"/{node}/parameters")

        def change(message: Any) -> None:
            message.data = json.dumps({**json.loads(message.data), name: value})

        again = changed(first, change)
        return [*messages, again._replace(log_time_ns=messages[-1].log_time_ns)]

    return edit


def one_changed(topic: str, index: int, change: Callable[[Any], None]) -> Edit:
    """Edit: change the index-th message of a topic."""

    def edit(messages: list[RawMessage]) -> list[RawMessage]:
        position = [k for k, message in enumerate(messages) if message.topic == topic][index]
        messages[position] = changed(messages[position], change)
        return messages

    return edit


def each_changed(change: Callable[[str, Any], Any]) -> Edit:
    """Edit: change every message; change(topic, message) returns it, or None to remove it."""

    def edit(messages: list[RawMessage]) -> Iterable[RawMessage]:
        for raw in messages:
            message = change(raw.topic, deserialize_message(raw.data, kind_of(raw.topic)))
            if message is not None:
                yield raw._replace(data=bytes(serialize_message(message)))

    return edit


def swapped(topic: str, index: int) -> Edit:
    """Edit: swap two messages but not their log times, by which readers would sort them."""

    def edit(messages: list[RawMessage]) -> list[RawMessage]:
        a, b = [k for k, m in enumerate(messages) if m.topic == topic][index : index + 2]
        first, second = messages[a], messages[b]
        messages[a] = first._replace(data=second.data)
        messages[b] = second._replace(data=first.data)
        return messages

    return edit


def set_field(key: str, alter: Callable[[str], str]) -> Callable[[Any], None]:
    """A change of one value of a planner/decision."""

    def change(message: Any) -> None:
        (item,) = (item for item in message.status[0].values if item.key == key)
        item.value = alter(item.value)

    return change


def last_bit(text: str) -> str:
    """'x,y' with the last bit of y's mantissa flipped."""
    x, y = text.split(",")
    return f"{x},{math.nextafter(float(y), math.inf)!r}"
