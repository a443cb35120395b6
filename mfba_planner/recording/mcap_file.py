# SPDX-License-Identifier: Apache-2.0
"""An open MCAP file with the index of its records, and access to them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Channel, Metadata, MetadataIndex, Schema

from . import mcap_records
from .file_integrity import check_data
from .mcap_records import FRAME, reading
from .message_definitions import Definition
from .storage_file import Span, StoredMessage, StoredTopic


class Piece(NamedTuple):
    """A chunk, or a run of messages outside chunks; times in ns."""

    offset: int
    length: int
    start_ns: int
    end_ns: int
    is_chunk: bool


@dataclass
class McapFile:
    """The index of one open file; `damage` describes what cannot be read.

    Messages name `path`; `source` is read, another file if that one was compressed.
    """

    path: Path
    stream: BinaryIO
    size: int
    source: Path
    kind: str = "mcap"
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    counts: Counter[int] = field(default_factory=Counter)
    pieces: list[Piece] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    bytes_lost: int = 0
    complete: bool = False

    def topics(self) -> list[StoredTopic]:
        """All topics of the file; a channel without schema has an empty type name."""
        return [
            StoredTopic(
                channel_id=number,
                name=channel.topic,
                encoding=channel.message_encoding,
                definition=self._definition(channel),
                offered_qos=channel.metadata.get("offered_qos_profiles"),
                message_count=self.counts[number],
            )
            for number, channel in self.channels.items()
        ]

    def _definition(self, channel: Channel) -> Definition:
        type_hash = channel.metadata.get("topic_type_hash", "")
        schema = self.schemas.get(channel.schema_id)
        if schema is None:
            return Definition("", "", type_hash, "")
        text = schema.data.decode("utf-8", "replace")
        return Definition(schema.name, text, type_hash, schema.encoding)

    def spans(self) -> Iterator[Span]:
        """The pieces, in file sequence."""
        for piece in self.pieces:
            yield Span(piece.start_ns, piece.end_ns, partial(self._load, piece))

    def _load(self, piece: Piece, channel_ids: frozenset[int]) -> list[StoredMessage]:
        return [m for m in self.messages(piece) if m.channel_id in channel_ids]

    def check(self) -> None:
        """Compare the data section with its CRC. Raises BagError."""
        check_data(self.source, self.path)

    def close(self) -> None:
        """Close the file."""
        self.stream.close()

    def messages(self, piece: Piece) -> list[StoredMessage]:
        """The messages of a piece, in file sequence. Raises BagError."""
        with reading(self.path, f"the chunk at byte {piece.offset}"):
            if piece.is_chunk:
                return mcap_records.messages(
                    mcap_records.chunk_data(self.body(piece.offset, Opcode.CHUNK))
                )
            return mcap_records.messages(self.bytes_at(piece.offset, piece.length))

    def attachment(self, index: AttachmentIndex) -> Attachment:
        """One attachment with its data. Raises BagError."""
        with reading(self.path, f"the attachment {index.name!r}"):
            return mcap_records.attachment(self.body(index.offset, Opcode.ATTACHMENT))

    def metadata_record(self, index: MetadataIndex) -> dict[str, str]:
        """The content of one metadata record. Raises BagError."""
        with reading(self.path, f"the metadata record {index.name!r}"):
            body = self.body(index.offset, Opcode.METADATA)
            return dict(Metadata.read(mcap_records.body_stream(body)).metadata)

    def add_definition(self, opcode: int, body: bytes) -> None:
        """Add a schema or channel record; other records and repetitions are ignored."""
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(mcap_records.body_stream(body))
            self.schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(mcap_records.body_stream(body))
            self.channels.setdefault(channel.id, channel)

    def is_defined(self, channel: Channel) -> bool:
        """Whether the channel's schema is known (schema id 0: no schema)."""
        return channel.schema_id == 0 or channel.schema_id in self.schemas

    def body(self, offset: int, opcode: int) -> bytes:
        """The body of the record at `offset`. Raises ValueError for another opcode."""
        found, length = FRAME.unpack(self.bytes_at(offset, FRAME.size))
        if found != opcode:
            raise ValueError(f"record type {found} instead of {int(opcode)} at byte {offset}")
        return self.bytes_at(offset + FRAME.size, length)

    def bytes_at(self, offset: int, length: int) -> bytes:
        """Exactly `length` bytes. Raises ValueError if the file is shorter."""
        if offset + length > self.size:
            raise ValueError(f"{length} bytes wanted at byte {offset} of {self.size}")
        self.stream.seek(offset)
        data = self.stream.read(length)
        if len(data) != length:
            raise ValueError(f"the file became shorter than {self.size} bytes")
        return data
