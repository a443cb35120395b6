# SPDX-License-Identifier: Apache-2.0
"""What the reader of a bag needs of a storage file, whatever its format."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from mcap.records import Attachment, AttachmentIndex, MetadataIndex

from .message_definitions import Definition


class StoredTopic(NamedTuple):
    """A topic of one file: `offered_qos` as stored, `encoding` that of its messages."""

    channel_id: int
    name: str
    encoding: str
    definition: Definition
    offered_qos: Any
    message_count: int


class StoredMessage(NamedTuple):
    """One stored message; times in ns."""

    channel_id: int
    sequence: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes


class Span(NamedTuple):
    """A part of a file whose messages `load` reads; log times in ns.

    `is_sorted`: by log time; such a part may be read message by message. The argument of `load`
    names the wanted channels.
    """

    start_ns: int
    end_ns: int
    load: Callable[[frozenset[int]], Iterable[StoredMessage]]
    is_sorted: bool = False


class StorageFile(Protocol):
    """An open storage file; `damage` describes what cannot be read."""

    path: Path
    kind: str  # of the format, for people
    size: int
    attachments: list[AttachmentIndex]
    metadata: list[MetadataIndex]
    damage: list[str]
    bytes_lost: int
    complete: bool

    def topics(self) -> list[StoredTopic]:
        """All topics of the file, those that cannot be read included."""

    def spans(self) -> Iterator[Span]:
        """The parts that hold messages, in file sequence."""

    def attachment(self, index: AttachmentIndex) -> Attachment:
        """One attachment with its data. Raises BagError."""

    def metadata_record(self, index: MetadataIndex) -> dict[str, str]:
        """The content of one metadata record. Raises BagError."""

    def check(self) -> None:
        """Compare the data with its checksum, where it has one. Raises BagError."""

    def close(self) -> None:
        """Close the file."""
