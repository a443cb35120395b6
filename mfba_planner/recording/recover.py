# SPDX-License-Identifier: Apache-2.0
"""Recover the whole records of a killed, truncated or damaged bag into a new bag."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import BagError
from . import bag_metadata
from .bag_reader import BagReader
from .bag_writer import BagWriter


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoverReport:
    """Counts of copied messages, source chunks and attachments; bytes lost and `problems`."""

    source: Path
    output: Path
    messages: int
    chunks: int
    attachments: int
    bytes_lost: int
    problems: tuple[str, ...]


def recover(path: str | Path, out_dir: str | Path) -> RecoverReport:
    """Copy the whole records of a bag into a new one, streaming; the source is not changed.

    Raises BagError if there are none, OutputError if `out_dir` exists or the disk is full.
    """
    with _recovering(), BagReader(path, salvage=True) as reader:
        if not reader.message_count and not reader.complete:
            raise BagError(
                f"{path}: not one whole chunk in {reader.size_bytes} bytes, "
                "there is nothing to recover; record again"
            )
        writer = BagWriter(out_dir, ros_distro=reader.ros_distro)
        try:
            attachments = _copy(reader, writer)
            writer.close()
        except BaseException:
            # The source still exists, so a partial copy is removed.
            writer.discard()
            raise
        return RecoverReport(
            source=reader.path,
            output=Path(out_dir),
            messages=writer.message_count,
            chunks=reader.chunk_count,
            attachments=attachments,
            bytes_lost=reader.bytes_lost,
            problems=(*reader.problems, *_left_out(reader)),
        )


@contextmanager
def _recovering() -> Iterator[None]:
    """Name another remedy where a message names this command."""
    try:
        yield
    except BagError as error:
        reason, _, remedy = str(error).partition("; ")
        if "mfba recover" not in remedy:
            raise
        raise BagError(f"{reason}; nothing of it can be recovered, record again") from error


def _left_out(reader: BagReader) -> Iterator[str]:
    """What was not copied because it is not CDR."""
    yield from (f"left out {text}" for text in reader.left_out)
    for topic, count in reader.not_cdr.items():
        yield f"{topic}: left out {count} messages that are not CDR"


def _copy(reader: BagReader, writer: BagWriter) -> int:
    """Copy everything and return the number of attachments."""
    attachments = 0
    for attachment in reader.iter_attachments():
        writer.attach(
            attachment.name,
            attachment.media_type,
            attachment.data,
            log_time_ns=attachment.log_time,
            create_time_ns=attachment.create_time,
        )
        attachments += 1
    for name, content in reader.metadata_records():
        if name != bag_metadata.RECORD_NAME:  # the writer makes its own
            writer.add_metadata(name, content)
    for topic in reader.topics.values():
        definition = reader.definitions[topic.type_name]
        writer.add_topic(topic.name, topic.type_name, topic.qos, definition=definition)
    for message in reader.messages(in_file_order=True):
        writer.write(
            message.topic,
            message.data,
            message.log_time_ns,
            message.publish_time_ns,
            sequence=message.sequence,
        )
    return attachments
