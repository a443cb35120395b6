# SPDX-License-Identifier: Apache-2.0
"""Write a bag directory: an MCAP file in rosbag2's format, and metadata.yaml at the end."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from mcap.well_known import MessageEncoding, Profile
from mcap.writer import CompressionType, Writer

from ..core.errors import OutputError
from . import atomic_files, bag_metadata, bag_qos
from .bag_metadata import BagFile, BagMetadata, BagTopic
from .bag_qos import OfferedQos
from .message_definitions import Definition, definition_of
from .packed_chunk_index import pack_last_chunk_index

CHUNK_BYTES = 512 * 1024
MAX_CHUNK_AGE_S = 0.8  # the limit is 1 s; 0.2 s are left for a late timer
_MESSAGE_OVERHEAD = 31  # bytes around each message in a chunk
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class BagWriter:
    """A bag being recorded into a new directory; `close` completes it.

    After kill -9 only the chunk in progress is lost. A chunk ends at `chunk_bytes`, or before
    `max_chunk_age_s` if a regular timer calls `flush_if_due`. Raises OutputError for a directory
    that exists or cannot be written, and for a full disk.
    """

    def __init__(
        self,
        directory: str | Path,
        *,
        chunk_bytes: int = CHUNK_BYTES,
        max_chunk_age_s: float = MAX_CHUNK_AGE_S,
        compression: CompressionType = CompressionType.ZSTD,
        ros_distro: str = bag_metadata.ROS_DISTRO,
    ) -> None:
        if not hasattr(Writer, "flush"):
            raise OutputError("mcap: this version cannot end a chunk; install mcap 1.5 or newer")
        self.directory = Path(os.path.abspath(directory))
        self.path = self.directory / f"{self.directory.name}_0.mcap"
        self._chunk_bytes = chunk_bytes
        self._max_age_ns = round(max_chunk_age_s * 1e9)
        self._ros_distro = ros_distro
        self._topics: dict[str, BagTopic] = {}
        self._channel_ids: dict[str, int] = {}
        self._schema_ids: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._start_ns = bag_metadata.NO_TIME_NS
        self._end_ns = 0
        self._pending_bytes = 0
        self._pending_count = 0
        self._stored_count = 0
        self._last_call_ns: int | None = None
        self._empty_since_ns = 0  # steady time at which nothing was pending
        self._end_reason = ""  # why nothing more can be written; "" while open
        self._made_directories = atomic_files.make_directory(self.directory)
        try:
            self._stream = atomic_files.WholeWriteFile(self.path)
        except OSError as error:
            atomic_files.remove_empty(self._made_directories)
            raise atomic_files.creation_error(self.directory, error) from error
        try:
            # This class ends chunks, by size and age; mcap's own limit must never apply.
            self._writer = Writer(
                self._stream,  # type: ignore[arg-type]
                chunk_size=1 << 62,
                compression=compression,
                enable_data_crcs=True,
            )
            self._writer.start(profile=Profile.ROS2, library="mfba_planner")
            self._write_record()
        except BaseException as error:
            self.discard()
            if isinstance(error, OSError):
                raise atomic_files.creation_error(self.directory, error) from error
            raise

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def message_count(self) -> int:
        """Messages written, including the chunk in progress."""
        return self._stored_count + self._pending_count

    @property
    def counts(self) -> Mapping[str, int]:
        """Messages written so far, by topic: a view that goes on counting."""
        return MappingProxyType(self._counts)

    @property
    def topics(self) -> dict[str, BagTopic]:
        """The topics by name, with their counts so far."""
        return {
            name: replace(topic, message_count=self._counts[name])
            for name, topic in self._topics.items()
        }

    def add_topic(
        self,
        name: str,
        type_name: str,
        offered: OfferedQos | Iterable[OfferedQos] = (),
        *,
        definition: Definition | None = None,
    ) -> None:
        """Add a topic, also while recording; adding it again with the same type changes nothing.

        `definition` defaults to the installed one. Raises InputError for a type that is not
        installed, OutputError for another type on a known topic.
        """
        known = self._topics.get(name)
        if known is not None:
            if known.type_name != type_name:
                raise OutputError(
                    f"{name}: recorded as {known.type_name}, not as {type_name}; "
                    "give the topic one type"
                )
            return
        definition = definition or definition_of(type_name)
        profiles = (offered,) if isinstance(offered, OfferedQos) else tuple(offered)
        with self._writing():
            if type_name not in self._schema_ids:
                self._schema_ids[type_name] = self._writer.register_schema(
                    type_name, definition.encoding, definition.text.encode()
                )
            self._channel_ids[name] = self._writer.register_channel(
                name,
                MessageEncoding.CDR,
                self._schema_ids[type_name],
                {
                    "offered_qos_profiles": bag_qos.to_text(profiles),
                    "topic_type_hash": definition.type_hash,
                },
            )
        self._counts[name] = 0
        self._topics[name] = BagTopic(
            name=name, type_name=type_name, qos=profiles, type_hash=definition.type_hash
        )

    def write(
        self,
        topic: str,
        cdr_bytes: bytes,
        log_time_ns: int,
        publish_time_ns: int,
        *,
        sequence: int | None = None,
    ) -> None:
        """Store one serialized message; `sequence` defaults to the topic's message count.

        Raises OutputError for an unknown topic, a time below 0 or from 2**63 - 1 on, a full disk.
        """
        count = self._counts.get(topic)
        if count is None:
            raise OutputError(f"{topic}: not a topic of this bag; add it with add_topic")
        for time_ns in (log_time_ns, publish_time_ns):
            if not 0 <= time_ns < bag_metadata.NO_TIME_NS:
                raise OutputError(
                    f"{topic}: time {time_ns} ns cannot be stored; give 0 to 2**63 - 2"
                )
        self._require_open()
        try:
            # Goes into memory only; flush writes. (No _writing: it would double the cost.)
            self._writer.add_message(
                self._channel_ids[topic],
                log_time_ns,
                cdr_bytes,
                publish_time_ns,
                count & 0xFFFFFFFF if sequence is None else sequence,
            )
        except BaseException:
            self._end()
            raise
        self._counts[topic] = count + 1
        self._pending_count += 1
        self._pending_bytes += len(cdr_bytes) + _MESSAGE_OVERHEAD
        self._start_ns = min(self._start_ns, log_time_ns)
        self._end_ns = max(self._end_ns, log_time_ns)
        if self._pending_bytes >= self._chunk_bytes:
            self.flush()

    def flush(self) -> None:
        """End the chunk in progress and write it to the file."""
        with self._writing():
            self._writer.flush()
        pack_last_chunk_index(self._writer)
        self._stored_count += self._pending_count
        self._pending_count = self._pending_bytes = 0
        self._empty_since_ns = self._last_call_ns or 0

    def flush_if_due(self, steady_now_ns: int) -> None:
        """Flush before the chunk in progress gets too old; call it from a regular timer.

        The oldest message may be as old as the last time at which nothing was pending, and the
        next call is one period away. Both count towards the age of the chunk.
        """
        last_ns, self._last_call_ns = self._last_call_ns, steady_now_ns
        if self._pending_count:
            period_ns = steady_now_ns - (last_ns or 0)
            if steady_now_ns + period_ns - self._empty_since_ns < self._max_age_ns:
                return
            self.flush()
        self._empty_since_ns = steady_now_ns

    def attach(
        self,
        name: str,
        media_type: str,
        data: bytes,
        *,
        log_time_ns: int = 0,
        create_time_ns: int = 0,
    ) -> None:
        """Store a file inside the bag immediately."""
        with self._writing():
            self._writer.add_attachment(create_time_ns, log_time_ns, name, media_type, data)

    def add_metadata(self, name: str, content: Mapping[str, str]) -> None:
        """Store a metadata record immediately."""
        with self._writing():
            self._writer.add_metadata(name, dict(content))

    def close(self) -> None:
        """Finish the file and write metadata.yaml; does nothing if closed or after a failure."""
        if self._end_reason:
            return
        self.flush()
        with self._writing():
            self._write_record()
            self._writer.finish()
            self._stream.close()
            text = bag_metadata.dump_file(self._content())
            atomic_files.write_atomically(self.directory / bag_metadata.FILE_NAME, text)
        self._end()

    def discard(self) -> None:
        """Close without finishing and remove what was written."""
        self._end()
        for path in (self.path, self.directory / bag_metadata.FILE_NAME):
            with suppress(OSError):
                path.unlink()
        atomic_files.remove_empty(self._made_directories)

    def _content(self) -> BagMetadata:
        file = BagFile(
            path=self.path.name,
            start_ns=self._start_ns,
            duration_ns=max(self._end_ns - self._start_ns, 0),
            message_count=self.message_count,
        )
        return BagMetadata(
            topics=tuple(self.topics.values()), files=(file,), ros_distro=self._ros_distro
        )

    def _write_record(self) -> None:
        text = bag_metadata.dump_record(self._content())
        self._writer.add_metadata(bag_metadata.RECORD_NAME, {bag_metadata.RECORD_KEY: text})

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Raise OutputError after the end; close the file, recoverable, if the body fails.

        An interrupt counts as a failure: mcap's indexes may no longer match the file.
        """
        self._require_open()
        try:
            yield
        except OSError as error:
            problem = "disk full" if error.errno in _FULL else "cannot be written"
            self._end(
                f"{self.directory}: {problem} after {self._stored_count} messages "
                f"({error.strerror}); make room and run `mfba recover {self.directory}`"
            )
            raise OutputError(self._end_reason) from error
        except BaseException:
            self._end()
            raise

    def _require_open(self) -> None:
        if self._end_reason:
            raise OutputError(self._end_reason)

    def _end(self, reason: str = "") -> None:
        """Close the file; later writes raise the first reason again."""
        self._end_reason = (
            self._end_reason
            or reason
            or (f"{self.directory}: the recording has ended; record into a new directory")
        )
        with suppress(OSError):
            self._stream.close()
