# SPDX-License-Identifier: Apache-2.0
"""Read any bag, without rclpy: a run directory, a bag directory or a file of rosbag2 or ROS 1."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mcap.records import Attachment, AttachmentIndex

from ..core.errors import BagError
from ..core.output_files import bag_in
from . import bag_metadata, bag_qos
from .bag_files import find_bag_files
from .bag_metadata import BagTopic
from .log_times import LogTimes
from .merge_by_time import RawMessage, Source, merge_by_log_time
from .message_data import cdr_bytes
from .message_decoder import decoder
from .message_definitions import Definition
from .open_storage import open_storage
from .storage_file import Span, StorageFile, StoredTopic


class DecodedMessage(NamedTuple):
    """One message with attribute access to its fields; times in ns."""

    topic: str
    type_name: str
    message: Any
    log_time_ns: int
    publish_time_ns: int


class _OpenFile(NamedTuple):
    storage: StorageFile
    topics: dict[int, str]  # topic name by channel id, of the channels that are read


class BagReader:
    """An open bag.

    A bag that was never closed or is damaged raises BagError. With `salvage` its whole records
    are read, and `problems` lists what is missing. `left_out` lists the topics that hold other
    messages than ROS 2's; they are nowhere else. All messages are CDR, those decompressed that
    were compressed one by one.
    """

    def __init__(self, path: str | Path, *, salvage: bool = False) -> None:
        self.path = bag_in(Path(path))
        bag_files = find_bag_files(self.path, salvage=salvage)
        self._problems = bag_files.problems
        self.left_out: list[str] = []
        self.not_cdr: Counter[str] = Counter()  # messages that salvaging left out, by topic
        self._salvage = salvage
        self._metadata = bag_files.metadata
        self._topics: dict[str, BagTopic] = {}
        self._definitions: dict[str, Definition] = {}
        self._files: list[_OpenFile] = []
        self._stack = ExitStack()
        try:
            for file_path in bag_files.files:
                self._open(file_path)
            self._require_topics()
            self._times = LogTimes(self._spans())
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
    def problems(self) -> list[str]:
        """What is missing or damaged, as far as it is known."""
        damage = (text for file in self._files for text in file.storage.damage)
        return [*damage, *self._problems]

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
        return self._times.start_ns

    @property
    def end_ns(self) -> int | None:
        """Log time of the latest message, None for a bag without messages."""
        return self._times.end_ns

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
        return sum(file.storage.bytes_lost for file in self._files)

    @property
    def chunk_count(self) -> int:
        """Number of chunks with messages, and of runs of messages outside chunks."""
        return sum(1 for _ in self._spans())

    @property
    def size_bytes(self) -> int:
        """Size of all storage files."""
        return sum(file.storage.size for file in self._files)

    @property
    def file_paths(self) -> tuple[Path, ...]:
        """The storage files."""
        return tuple(file.storage.path for file in self._files)

    @property
    def kind(self) -> str:
        """Format of the storage files, for people."""
        return "; ".join(dict.fromkeys(file.storage.kind for file in self._files))

    def check_data(self) -> None:
        """Compare the files with their checksums, where they have some. Raises BagError."""
        for file in self._files:
            file.storage.check()

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
        return tuple(index for file in self._files for index in file.storage.attachments)

    def iter_attachments(self) -> Iterator[Attachment]:
        """The attachments with their data. Raises BagError."""
        for file in self._files:
            for index in file.storage.attachments:
                yield file.storage.attachment(index)

    def attachment(self, name: str) -> bytes | None:
        """The data of the newest attachment of that name, None without one. Raises BagError."""
        for file in reversed(self._files):
            for index in reversed(file.storage.attachments):
                if index.name == name:
                    return bytes(file.storage.attachment(index).data)
        return None

    def metadata_records(self) -> Iterator[tuple[str, dict[str, str]]]:
        """(name, content) of each metadata record. Raises BagError."""
        for file in self._files:
            for index in file.storage.metadata:
                yield index.name, file.storage.metadata_record(index)

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
            Source(
                self._times.valid(span.start_ns),
                partial(self._load, file, span, topics, start_ns),
                span.is_sorted,
            )
            for file in self._files
            for span in file.storage.spans()
            if self._times.valid(span.end_ns) >= start_ns
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

    def _spans(self) -> Iterator[Span]:
        return (span for file in self._files for span in file.storage.spans())

    def _load(
        self, file: _OpenFile, span: Span, topics: Collection[str] | None, start_ns: int
    ) -> Iterable[RawMessage]:
        wanted = {
            channel_id: (name, self._topics[name].type_name)
            for channel_id, name in file.topics.items()
            if topics is None or name in topics
        }
        last_ns = self._times.valid(span.start_ns)
        for channel_id, sequence, time_ns, publish_ns, stored in span.load(frozenset(wanted)):
            # A message without a valid log time gets that of the one before it.
            last_ns = time_ns if self._times.is_valid(time_ns) else last_ns
            if last_ns < start_ns:
                continue
            name, type_name = wanted[channel_id]
            data = cdr_bytes(stored)
            if data is None:
                self._refuse(name, last_ns, stored)
                continue
            publish_ns = publish_ns if publish_ns < bag_metadata.NO_TIME_NS else last_ns
            yield RawMessage(name, type_name, data, last_ns, publish_ns, sequence)

    def _refuse(self, topic: str, time_ns: int, data: bytes) -> None:
        """Count what is not CDR if salvaging, else raise BagError."""
        if not self._salvage:
            raise BagError(
                f"{self.path}: a message on {topic} at {time_ns} ns is not CDR (its first bytes "
                f"are {data[:4].hex(' ') or 'missing'}); leave the topic out, or run "
                f"`mfba recover {self.path}`, which leaves such messages out"
            )
        self.not_cdr[topic] += 1

    def _decoder(self, raw: RawMessage) -> Callable[[bytes], Any]:
        try:
            return decoder(self._definitions[raw.type_name])
        except BagError as error:
            raise BagError(
                f"{self.path}: topic {raw.topic} ({raw.type_name}) cannot be decoded ({error}); "
                "leave the topic out"
            ) from error

    def _open(self, path: Path) -> None:
        storage = open_storage(path, self._stack, salvage=self._salvage)
        if not storage.complete:
            self._problems.append(f"{path.name}: the end of the file is missing")
        file = _OpenFile(storage, {})
        self._files.append(file)
        for stored in storage.topics():
            if stored.encoding != "cdr":
                self.left_out.append(
                    f"{stored.name}: {stored.message_count} messages serialized as "
                    f"{stored.encoding!r}, only cdr can be read"
                )
                continue
            topic = self._topic(stored)
            known = self._topics.setdefault(topic.name, topic)
            if known.type_name != topic.type_name:
                self._problems.append(
                    f"{topic.name}: left out {stored.message_count} messages of a second type, "
                    f"{topic.type_name}"
                )
                continue
            file.topics[stored.channel_id] = topic.name
            self._topics[topic.name] = replace(
                known,
                qos=tuple(dict.fromkeys(known.qos + topic.qos)),
                message_count=known.message_count + stored.message_count,
            )

    def _topic(self, stored: StoredTopic) -> BagTopic:
        name, definition = stored.name, stored.definition
        listed = BagTopic(name=name, type_name="")
        if self._metadata is not None:
            listed = next((t for t in self._metadata.topics if t.name == name), listed)
        try:
            offered = bag_qos.from_list(stored.offered_qos)
        except BagError as error:
            self._problems.append(f"{name}: {str(error).split('; ')[0]}")
            offered = ()
        definition = replace(
            definition,
            type_name=definition.type_name or listed.type_name,
            type_hash=definition.type_hash or listed.type_hash,
        )
        known = self._definitions.setdefault(definition.type_name, definition)
        if definition.text and not known.text:
            self._definitions[definition.type_name] = definition
        return BagTopic(
            name=name,
            type_name=definition.type_name,
            qos=offered or listed.qos,
            type_hash=definition.type_hash,
        )

    def _require_topics(self) -> None:
        if self.left_out and not self._topics:
            raise BagError(
                f"{self.path}: no topic that can be read: {'; '.join(self.left_out)}; "
                "record with ROS 2's default serialization"
            )

    def _compare_counts(self) -> None:
        if self._metadata is None:
            return
        listed, found = self._metadata.message_count, self.message_count
        if listed != found and not self.left_out:
            self._problems.append(
                f"{bag_metadata.FILE_NAME} counts {listed} messages, the files hold {found}"
            )
