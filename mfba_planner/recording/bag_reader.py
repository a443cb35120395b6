# SPDX-License-Identifier: Apache-2.0
"""Read a bag of mfba or rosbag2, a directory or a bare .mcap file, without rclpy."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mcap.records import Attachment, AttachmentIndex, Channel, Schema
from mcap_ros2.decoder import DecoderFactory

from ..core.errors import BagError
from . import bag_metadata, bag_qos
from .bag_files import find_bag_files
from .bag_metadata import BagTopic
from .mcap_file import McapFile, Piece
from .mcap_index import open_file
from .merge_by_time import RawMessage, Source, merge_by_log_time
from .message_definitions import Definition


class DecodedMessage(NamedTuple):
    """One message with attribute access to its fields; times in ns."""

    topic: str
    type_name: str
    message: Any
    log_time_ns: int
    publish_time_ns: int


class _OpenFile(NamedTuple):
    mcap: McapFile
    topics: dict[int, str]  # topic name by channel id, of the channels that are read


class BagReader:
    """An open bag.

    A bag that was never closed or is damaged raises BagError. With `salvage` its whole records
    are read, and `problems` lists what is missing.
    """

    def __init__(self, path: str | Path, *, salvage: bool = False) -> None:
        self.path = Path(path)
        bag_files = find_bag_files(self.path, salvage=salvage)
        self.problems = bag_files.problems
        self._metadata = bag_files.metadata
        self._topics: dict[str, BagTopic] = {}
        self._definitions: dict[str, Definition] = {}
        self._files: list[_OpenFile] = []
        self._stack = ExitStack()
        try:
            for file_path in bag_files.files:
                self._open(file_path, salvage)
        except BaseException:
            self.close()
            raise
        self._compare_counts()

    def close(self) -> None:
        """Close the files."""
        self._stack.close()

    def __enter__(self) -> BagReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def topics(self) -> dict[str, BagTopic]:
        """The topics by name, with the message counts of the files."""
        return dict(self._topics)

    @property
    def definitions(self) -> dict[str, Definition]:
        """Type definitions as recorded, by type name."""
        return dict(self._definitions)

    @property
    def message_count(self) -> int:
        """Messages on all topics."""
        return sum(topic.message_count for topic in self._topics.values())

    @property
    def start_ns(self) -> int | None:
        """Log time of the earliest message, None for a bag without messages."""
        return min((piece.start_ns for _, piece in self._pieces()), default=None)

    @property
    def end_ns(self) -> int | None:
        """Log time of the latest message, None for a bag without messages."""
        return max((piece.end_ns for _, piece in self._pieces()), default=None)

    @property
    def duration_ns(self) -> int:
        """Time from the earliest to the latest message."""
        return (self.end_ns or 0) - (self.start_ns or 0)

    @property
    def complete(self) -> bool:
        """Whether opening the bag found it closed and undamaged."""
        return not self.problems

    @property
    def bytes_lost(self) -> int:
        """Bytes that hold no whole record (counted when salvaging)."""
        return sum(file.mcap.bytes_lost for file in self._files)

    @property
    def chunk_count(self) -> int:
        """Number of chunks with messages, and of runs of messages outside chunks."""
        return sum(1 for _ in self._pieces())

    @property
    def size_bytes(self) -> int:
        """Size of all storage files."""
        return sum(file.mcap.size for file in self._files)

    @property
    def file_paths(self) -> tuple[Path, ...]:
        """The storage files."""
        return tuple(file.mcap.path for file in self._files)

    @property
    def ros_distro(self) -> str:
        """ROS distribution of the recorder, "unknown" if not recorded. Raises BagError."""
        if self._metadata is not None:
            return self._metadata.ros_distro
        for name, content in self.metadata_records():
            text = (
                content.get(bag_metadata.RECORD_KEY, "")
                if name == bag_metadata.RECORD_NAME
                else ""
            )
            found = re.search(r"^ros_distro: (\w+)", text, re.MULTILINE)
            if found:
                return found[1]
        return "unknown"

    @property
    def attachments(self) -> tuple[AttachmentIndex, ...]:
        """Name, media type, size and times of each attachment."""
        return tuple(index for file in self._files for index in file.mcap.attachments)

    def iter_attachments(self) -> Iterator[Attachment]:
        """The attachments with their data. Raises BagError."""
        for file in self._files:
            for index in file.mcap.attachments:
                yield file.mcap.attachment(index)

    def attachment(self, name: str) -> bytes | None:
        """The data of the newest attachment of that name, None without one. Raises BagError."""
        for file in reversed(self._files):
            for index in reversed(file.mcap.attachments):
                if index.name == name:
                    return bytes(file.mcap.attachment(index).data)
        return None

    def metadata_records(self) -> Iterator[tuple[str, dict[str, str]]]:
        """(name, content) of each metadata record. Raises BagError."""
        for file in self._files:
            for index in file.mcap.metadata:
                yield index.name, file.mcap.metadata_record(index)

    def messages(
        self,
        topics: Collection[str] | None = None,
        *,
        start_offset_s: float = 0.0,
        in_file_order: bool = False,
    ) -> Iterator[RawMessage]:
        """Raw messages sorted by log time, from `start_offset_s` after the bag's start on.

        Holds the chunks that overlap in time; with `in_file_order` one chunk. Raises BagError.
        """
        start_ns = (self.start_ns or 0) + round(start_offset_s * 1e9)
        sources = [
            Source(piece.start_ns, partial(self._load, file, piece, topics, start_ns))
            for file, piece in self._pieces()
            if piece.end_ns >= start_ns
        ]
        if not in_file_order:
            return merge_by_log_time(sources)
        return (message for source in sources for message in source.load())

    def decoded(
        self, topics: Collection[str] | None = None, *, start_offset_s: float = 0.0
    ) -> Iterator[DecodedMessage]:
        """Messages decoded by the bag's own schemas, sorted by log time. Raises BagError."""
        decoders: dict[str, Callable[[bytes], Any]] = {}
        for raw in self.messages(topics, start_offset_s=start_offset_s):
            if raw.type_name not in decoders:
                decoders[raw.type_name] = self._decoder(raw)
            try:
                message = decoders[raw.type_name](raw.data)
            except Exception as error:  # generated parsers raise any type
                raise BagError(
                    f"{self.path}: a message on {raw.topic} at {raw.log_time_ns} ns is not a "
                    f"{raw.type_name} ({type(error).__name__}); leave the topic out"
                ) from error
            yield DecodedMessage(
                raw.topic, raw.type_name, message, raw.log_time_ns, raw.publish_time_ns
            )

    def _pieces(self) -> Iterator[tuple[_OpenFile, Piece]]:
        return ((file, piece) for file in self._files for piece in file.mcap.pieces)

    def _load(
        self, file: _OpenFile, piece: Piece, topics: Collection[str] | None, start_ns: int
    ) -> list[RawMessage]:
        wanted = {
            channel_id: (name, self._topics[name].type_name)
            for channel_id, name in file.topics.items()
            if topics is None or name in topics
        }
        return [
            RawMessage(*wanted[channel_id], data, log_time_ns, publish_time_ns, sequence)
            for channel_id, sequence, log_time_ns, publish_time_ns, data in (
                file.mcap.messages(piece)
            )
            if log_time_ns >= start_ns and channel_id in wanted
        ]

    def _decoder(self, raw: RawMessage) -> Callable[[bytes], Any]:
        known = self._definitions[raw.type_name]
        schema = Schema(
            id=1, name=known.type_name, encoding=known.encoding, data=known.text.encode()
        )
        reason = f"schema encoding {known.encoding!r}, not ros2msg"
        try:
            decoder = DecoderFactory().decoder_for("cdr", schema)
        except Exception as error:  # the schema parser has no error of its own
            decoder, reason = None, f"its schema does not parse: {type(error).__name__}"
        if decoder is None:
            raise BagError(
                f"{self.path}: topic {raw.topic} ({raw.type_name}) cannot be decoded ({reason}); "
                "leave the topic out"
            )
        return decoder

    def _open(self, path: Path, salvage: bool) -> None:
        mcap = open_file(path, salvage=salvage)
        self._stack.callback(mcap.stream.close)
        self.problems += mcap.damage
        if not mcap.complete:
            self.problems.append(f"{path.name}: the end of the file is missing")
        file = _OpenFile(mcap, {})
        self._files.append(file)
        for channel_id, channel in mcap.channels.items():
            topic = self._topic(channel, mcap.schemas.get(channel.schema_id), path)
            known = self._topics.setdefault(topic.name, topic)
            count = mcap.counts[channel_id]
            if known.type_name != topic.type_name:
                self.problems.append(
                    f"{topic.name}: left out {count} messages of a second type, {topic.type_name}"
                )
                continue
            file.topics[channel_id] = topic.name
            self._topics[topic.name] = replace(
                known,
                qos=tuple(dict.fromkeys(known.qos + topic.qos)),
                message_count=known.message_count + count,
            )

    def _topic(self, channel: Channel, schema: Schema | None, path: Path) -> BagTopic:
        name = channel.topic
        if channel.message_encoding != "cdr":
            raise BagError(
                f"{path}: topic {name} is serialized as {channel.message_encoding!r}, "
                "only cdr can be read; convert the bag with `ros2 bag convert`"
            )
        listed = BagTopic(name=name, type_name="")
        if self._metadata is not None:
            listed = next((t for t in self._metadata.topics if t.name == name), listed)
        try:
            offered = bag_qos.from_list(channel.metadata.get("offered_qos_profiles"))
        except BagError as error:
            self.problems.append(f"{name}: {str(error).split('; ')[0]}")
            offered = ()
        type_hash = channel.metadata.get("topic_type_hash") or listed.type_hash
        type_name, text, encoding = listed.type_name, "", ""
        if schema is not None:
            type_name, encoding = schema.name, schema.encoding
            text = schema.data.decode("utf-8", "replace")
        definition = Definition(type_name, text, type_hash, encoding)
        self._definitions.setdefault(type_name, definition)
        return BagTopic(
            name=name, type_name=type_name, qos=offered or listed.qos, type_hash=type_hash
        )

    def _compare_counts(self) -> None:
        if self._metadata is None:
            return
        listed, found = self._metadata.message_count, self.message_count
        if listed != found:
            self.problems.append(
                f"{bag_metadata.FILE_NAME} counts {listed} messages, the files hold {found}"
            )
