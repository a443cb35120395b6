# SPDX-License-Identifier: Apache-2.0
"""Open an MCAP file: refuse what is something else, index it by its summary or by a walk."""

from __future__ import annotations

import zlib
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, ChunkIndex, Footer, Header, MetadataIndex, Statistics

from ..core.errors import BagError
from .mcap_file import McapFile, Piece
from .mcap_records import FRAME, MAGIC, frames, parsed, reading
from .mcap_walk import walk

_FOOTER_BYTES = FRAME.size + 20
_TAIL_BYTES = _FOOTER_BYTES + len(MAGIC)
_OTHER_FORMATS = (
    (b"SQLite format 3\0", "a sqlite3 (.db3) bag", "rosbags-convert --dst-storage mcap"),
    (b"#ROSBAG V", "a ROS 1 bag", "rosbags-convert --dst-storage mcap"),
    (b"\x28\xb5\x2f\xfd", "compressed as a whole file", "zstd -d"),
)


def open_file(path: Path, *, salvage: bool = False) -> McapFile:
    """Open and index a file; `salvage` takes all that is whole of it. Raises BagError."""
    try:
        stream = path.open("rb")
    except OSError as error:
        raise BagError(
            f"{path}: cannot be read ({error.strerror}); give a .mcap file or a bag directory"
        ) from error
    try:
        with reading(path, "the file"):
            file = McapFile(path, stream, stream.seek(0, 2))
            _refuse_other_formats(file)
            _refuse_other_profiles(file)
            footer = _footer(file)
        if footer is None and not salvage:
            raise BagError(
                f"{path}: truncated, the end of the file is missing (the recording was not "
                f"closed); run `mfba recover {path}`"
            )
        file.complete = footer is not None
        if footer is None or salvage or not _read_summary(file, footer):
            walk(file, salvage=salvage)
        return file
    except BaseException:
        stream.close()
        raise


def _refuse_other_formats(file: McapFile) -> None:
    if file.size == 0:
        raise BagError(f"{file.path}: empty file; give a .mcap file or a bag directory")
    head = file.bytes_at(0, min(file.size, 16))
    for magic, kind, command in _OTHER_FORMATS:
        if head.startswith(magic):
            raise BagError(f"{file.path}: {kind}, not an MCAP file; convert it with `{command}`")
    if not head.startswith(MAGIC):
        raise BagError(
            f"{file.path}: not an MCAP file (no magic bytes); give a .mcap file or a bag directory"
        )


def _refuse_other_profiles(file: McapFile) -> None:
    try:
        header = Header.read(parsed(file.body(len(MAGIC), Opcode.HEADER)))
    except ValueError as error:
        raise BagError(
            f"{file.path}: truncated within its header ({file.size} bytes), nothing of it can be "
            "recovered; record again"
        ) from error
    if header.profile != "ros2":
        raise BagError(
            f"{file.path}: profile {header.profile!r}, only ros2 can be read; "
            "record with ROS 2, or convert it with `rosbags-convert`"
        )


def _footer(file: McapFile) -> Footer | None:
    """The footer of a file that was closed, None where the end is missing."""
    if file.size < _TAIL_BYTES:
        return None
    tail = file.bytes_at(file.size - _TAIL_BYTES, _TAIL_BYTES)
    if not tail.endswith(MAGIC) or FRAME.unpack_from(tail) != (Opcode.FOOTER, 20):
        return None
    return Footer.read(parsed(tail[FRAME.size :]))


def _read_summary(file: McapFile, footer: Footer) -> bool:
    """Fill the index from the summary; False, and nothing filled, where it does not suffice."""
    if footer.summary_start == 0:
        return False
    found = McapFile(file.path, file.stream, file.size)
    statistics: Statistics | None = None
    with reading(file.path, "the summary"):
        # The CRC covers all up to itself: the footer's last 4 bytes and the magic stay out.
        end = file.size - len(MAGIC) - 4
        data = file.bytes_at(footer.summary_start, end - footer.summary_start)
        if footer.summary_crc not in (0, zlib.crc32(data)):
            raise ValueError("wrong CRC")
        data = data[: 4 - _FOOTER_BYTES]
        for opcode, start, stop in frames(data):
            if opcode == Opcode.STATISTICS:
                statistics = Statistics.read(parsed(data[start:stop]))
            else:
                _take(found, opcode, data[start:stop])
    if statistics is None or not _suffices(found, statistics):
        return False
    file.schemas, file.channels, file.pieces = found.schemas, found.channels, found.pieces
    file.attachments, file.metadata = found.attachments, found.metadata
    file.counts.update(statistics.channel_message_counts)
    return True


def _take(file: McapFile, opcode: int, body: bytes) -> None:
    if opcode == Opcode.CHUNK_INDEX:
        chunk = ChunkIndex.read(parsed(body))
        file.pieces.append(
            Piece(
                offset=chunk.chunk_start_offset,
                length=chunk.chunk_length,
                start_ns=chunk.message_start_time,
                end_ns=chunk.message_end_time,
                is_chunk=True,
            )
        )
    elif opcode == Opcode.ATTACHMENT_INDEX:
        file.attachments.append(AttachmentIndex.read(parsed(body)))
    elif opcode == Opcode.METADATA_INDEX:
        file.metadata.append(MetadataIndex.read(parsed(body)))
    else:
        file.define(opcode, body)


def _suffices(summary: McapFile, statistics: Statistics) -> bool:
    """Whether a summary names everything the data section holds."""
    return (
        statistics.chunk_count == len(summary.pieces)
        and (statistics.chunk_count > 0 or statistics.message_count == 0)
        and statistics.attachment_count == len(summary.attachments)
        and statistics.metadata_count == len(summary.metadata)
        and statistics.channel_count == len(summary.channels)
        and statistics.channel_message_counts.keys() <= summary.channels.keys()
        and all(summary.is_defined(channel) for channel in summary.channels.values())
    )
