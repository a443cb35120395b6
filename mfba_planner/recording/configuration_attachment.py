# SPDX-License-Identifier: Apache-2.0
"""The configuration of a run as an attachment of its bag: write and read it.

`ros2 bag record` stores no attachment, and `ros2 bag convert` drops it. The nodes therefore
publish their parameters too, latched; these are the configuration of a bag without attachment.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..core.errors import BagError, OutputError
from .bag_reader import BagReader

if TYPE_CHECKING:  # reading a bag must not load the writer
    from .bag_writer import BagWriter

ATTACHMENT_NAME = "mfba_planner/configuration.json"
MEDIA_TYPE = "application/json"
SCHEMA_VERSION = 1
PARAMETERS = "/parameters"
_NODES, _STRING = ("planner", "virtual_sensor", "world_sim"), "std_msgs/msg/String"


def attach_configuration(writer: BagWriter, configuration: Mapping[str, Any]) -> None:
    """Store the configuration in a bag, with its schema_version. Raises OutputError."""
    content = {"schema_version": SCHEMA_VERSION, **configuration}
    try:
        text = json.dumps(content, indent=1, sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise OutputError(
            f"configuration: cannot be stored as JSON ({error}); use finite numbers and text"
        ) from error
    writer.attach(ATTACHMENT_NAME, MEDIA_TYPE, text.encode())


def has_configuration(reader: BagReader) -> bool:
    """Whether a bag holds a configuration, as an attachment or on topics."""
    is_attached = any(index.name == ATTACHMENT_NAME for index in reader.attachments)
    return is_attached or bool(_parameter_topics(reader))


def _parameter_topics(reader: BagReader) -> dict[str, str]:
    """The name of a node with its namespace, by its topic of parameters; with messages only."""
    return {
        name: name.removesuffix(PARAMETERS).strip("/")
        for name, topic in reader.topics.items()
        if topic.type_name == _STRING
        and topic.message_count
        and name.removesuffix(PARAMETERS).rpartition("/")[2] in _NODES
        and name.endswith(PARAMETERS)
    }


def published_parameters(text: str) -> dict[str, Any] | None:
    """The parameters that a node publishes as text; None for what is not JSON of an object."""
    try:
        values = json.loads(text)
    except ValueError:
        return None
    return values if isinstance(values, dict) else None


def parameter_changes(reader: BagReader) -> dict[str, list[str]]:
    """By node, with its namespace, the parameters that changed during the recording."""
    names = {
        topic: node
        for topic, node in _parameter_topics(reader).items()
        if reader.topics[topic].message_count > 1  # most bags need not be read for it
    }
    first: dict[str, dict[str, Any]] = {}
    found: dict[str, set[str]] = {}
    for message in reader.decoded(names) if names else ():
        if (values := published_parameters(message.message.data)) is not None:
            before = first.setdefault(node := names[message.topic], values)
            changed = {name for name in values if values[name] != before.get(name)}
            found[node] = found.get(node, set()) | changed
    return {node: sorted(changed) for node, changed in found.items() if changed}


def _from_topics(reader: BagReader) -> dict[str, Any] | None:
    """The configuration of the nodes' latched parameters, None where there are none."""
    names = _parameter_topics(reader)
    nodes: dict[str, Any] = {}
    for message in reader.decoded(names) if names else ():
        values = published_parameters(message.message.data)
        if values is None:
            raise BagError(
                f"{reader.path}: {message.topic} is not JSON of an object; give the parameters "
                "with `mfba verify --params-file FILE`"
            )
        nodes.setdefault(names[message.topic], values)  # as when the recording began
    return {"nodes": nodes, "run": {}} if nodes else None


def read_configuration(reader: BagReader) -> dict[str, Any]:
    """The configuration in a bag. Raises BagError if missing or of an unknown version."""
    data = reader.attachment(ATTACHMENT_NAME)
    if data is None and (published := _from_topics(reader)):
        return published
    if data is None:
        raise BagError(
            f"{reader.path}: has no {ATTACHMENT_NAME}, so it was not recorded by mfba; "
            "give the parameters of its nodes with `mfba verify --params-file FILE`, or use "
            "`mfba decide`"
        )
    try:
        content = json.loads(data)
    except ValueError as error:
        raise BagError(
            f"{reader.path}: {ATTACHMENT_NAME} is not JSON ({error}); record the bag again"
        ) from error
    version = content.get("schema_version") if isinstance(content, dict) else None
    if version != SCHEMA_VERSION:
        raise BagError(
            f"{reader.path}: {ATTACHMENT_NAME} has schema_version {version!r}, only "
            f"{SCHEMA_VERSION} can be read; use the mfba that recorded it"
        )
    if not content.get("nodes") and (published := _from_topics(reader)):
        content["nodes"] = published["nodes"]  # the recorder was told of no node
    return dict(content)
