# SPDX-License-Identifier: Apache-2.0
"""A bag of a real run, and copies of it that somebody has edited."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from mfba_planner.recording.merge import RawMessage
from mfba_planner.recording.reader import BagReader
from mfba_planner.recording.writer import BagWriter
from mfba_planner.ros import topics

KINDS = {f"/{topic.name.lstrip('/')}": topic.type for topic in topics.GRAPH}
Edit = Callable[[list[RawMessage]], Iterable[RawMessage]]


def rewrite(bag: Path, out: Path, edit: Edit, *, configuration: bool = True) -> Path:
    """A whole, sound bag with other messages: only what they say can betray it."""
    with BagReader(bag) as reader, BagWriter(out) as writer:
        for topic in reader.topics.values():
            writer.add_topic(topic.name, topic.type_name, topic.qos)
        for found in reader.iter_attachments():
            if configuration:
                writer.attach(found.name, found.media_type, found.data)
        for message in edit(list(reader.messages())):
            writer.write(message.topic, message.data, message.log_time_ns, message.publish_time_ns)
    return out


def changed(message: RawMessage, change: Callable[[Any], None]) -> RawMessage:
    """The message with something changed in it."""
    decoded = deserialize_message(message.data, KINDS[message.topic])
    change(decoded)
    return message._replace(data=serialize_message(decoded))


def one_changed(topic: str, index: int, change: Callable[[Any], None]) -> Edit:
    """Change the index-th message of a topic."""

    def edit(messages: list[RawMessage]) -> list[RawMessage]:
        place = [k for k, message in enumerate(messages) if message.topic == topic][index]
        messages[place] = changed(messages[place], change)
        return messages

    return edit


def set_field(key: str, alter: Callable[[str], str]) -> Callable[[Any], None]:
    """Change one value of a planner/decision."""

    def change(message: Any) -> None:
        (item,) = (item for item in message.status[0].values if item.key == key)
        item.value = alter(item.value)

    return change


def last_bit(text: str) -> str:
    """'x,y' with the last bit of y's mantissa flipped."""
    x, y = text.split(",")
    return f"{x},{math.nextafter(float(y), math.inf)!r}"
