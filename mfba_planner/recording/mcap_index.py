# SPDX-License-Identifier: Apache-2.0
"""Open an MCAP file: refuse other formats, index by its summary or record by record."""

from __future__ import annotations

import zlib
from contextlib import suppress
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, ChunkIndex, Footer, Header, MetadataIndex, Statistics

from ..core.errors import BagError
from ..core.input_files import open_input
from .mcap_file import McapFile, Piece
from .mcap_records import FRAME, MAGIC, body_stream, frames, reading
from .mcap_walk import walk

_FOOTER_BYTES = FRAME.size + 20
_TAIL_BYTES = _FOOTER_BYTES + len(MAGIC)
PROFILES = ("ros2", "")  # MCAP's; writers other than rosbag2 may leave it empty
GIVE_BAG = "give a bag directory, or a .mcap, .db3 or .bag file"


def open_file(path: Path, *, salvage: bool = False, shown: Path | None = None) -> McapFile:
    """Open and index a file; `salvage` indexes the whole records. Raises BagError.

    Messages name the file `shown`, where that is the one given by the user.
    """
    source, path = path, shown or path
    try:
        stream = open_input(source)
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}); {GIVE_BAG}") from error
    try:
        with reading(path, "the file"):
            file = McapFile(path, stream, stream.seek(0, 2), source)
            footer = _footer(file)
            _require_mcap(file, is_closed=salvage and footer is not None)
            if not salvage:
                _require_profile(file)
        if footer is None and not salvage:
            raise BagError(
                f"{path}: truncated, the end of the file is missing (the recording was not "
                f"closed); run `mfba recover {path}`"
            )
        file.complete = footer is not None
        if salvage:
            _salvage(file, footer)
        elif footer is None or not _read_summary(file, footer):
            walk(file, salvage=False)
        return file
    except BaseException:
        stream.close()
        raise


def _salvage(file: McapFile, footer: Footer | None) -> None:
    """Index the whole records, whatever has happened to the header and the summary."""
    try:
        with reading(file.path, "its header"):
            if file.bytes_at(0, len(MAGIC)) != MAGIC:
                raise ValueError("no magic bytes")
            _require_profile(file)
    except BagError:
        file.damage.append(f"{file.path.name}: its header is damaged, or not of ROS 2")
    found = McapFile(file.path, file.stream, file.size, file.source)
    with suppress(BagError):
        if footer is not None:
            _read_summary(found, footer)
    known = {piece.offset: Opcode.CHUNK for piece in found.pieces}
    known |= {attachment.offset: Opcode.ATTACHMENT for attachment in found.attachments}
    known |= {record.offset: Opcode.METADATA for record in found.metadata}
    walk(file, salvage=True, known=known)


def _require_mcap(file: McapFile, *, is_closed: bool) -> None:
    """Raise BagError for a file of another kind; what ends as MCAP does may begin otherwise."""
    if file.size == 0:
        raise BagError(f"{file.path}: empty file; {GIVE_BAG}")
    if not is_closed and not file.bytes_at(0, min(file.size, len(MAGIC))).startswith(MAGIC):
        raise BagError(
            f"{file.path}: neither MCAP nor sqlite3 nor a ROS 1 bag, by its first bytes; "
            f"{GIVE_BAG}"
        )


def _require_profile(file: McapFile) -> None:
    try:
        header = Header.read(body_stream(file.body(len(MAGIC), Opcode.HEADER)))
    except ValueError as error:
        raise BagError(
            f"{file.path}: truncated within its header ({file.size} bytes), nothing of it can be "
            "recovered; record again"
        ) from error
    if header.profile not in PROFILES:
        raise BagError(
            f"{file.path}: profile {header.profile!r}, only messages of ROS 2 (CDR) can be read "
            "from MCAP; give a recording of ROS 2, or the ROS 1 .bag itself; if it is one, run "
            f"`mfba recover {file.path}`"
        )


def _footer(file: McapFile) -> Footer | None:
    """The footer of a closed file, None if the end of the file is missing."""
    if file.size < _TAIL_BYTES:
        return None
    tail = file.bytes_at(file.size - _TAIL_BYTES, _TAIL_BYTES)
    if not tail.endswith(MAGIC) or FRAME.unpack_from(tail) != (Opcode.FOOTER, 20):
        return None
    return Footer.read(body_stream(tail[FRAME.size :]))


def _read_summary(file: McapFile, footer: Footer) -> bool:
    """Fill the index from the summary; False, with nothing filled, if it is incomplete."""
    if footer.summary_start == 0:
        return False
    found = McapFile(file.path, file.stream, file.size, file.source)
    statistics: Statistics | None = None
    with reading(file.path, "the summary"):
        # The CRC covers all bytes before itself: not the footer's last 4 bytes and the magic.
        end = file.size - len(MAGIC) - 4
        data = file.bytes_at(footer.summary_start, end - footer.summary_start)
        if footer.summary_crc not in (0, zlib.crc32(data)):
            raise ValueError("wrong CRC")
        data = data[: 4 - _FOOTER_BYTES]
        for opcode, start, stop in frames(data):
            if opcode == Opcode.STATISTICS:
                statistics = Statistics.read(body_stream(data[start:stop]))
            else:
                _add_index_record(found, opcode, data[start:stop])
    if statistics is None or not _is_complete(found, statistics):
        return False
    file.schemas, file.channels, file.pieces = found.schemas, found.channels, found.pieces
    file.attachments, file.metadata = found.attachments, found.metadata
    file.counts.update(statistics.channel_message_counts)
    return True


def _add_index_record(file: McapFile, opcode: int, body: bytes) -> None:
    if opcode == Opcode.CHUNK_INDEX:
        chunk = ChunkIndex.read(body_stream(body))
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
        file.attachments.append(AttachmentIndex.read(body_stream(body)))
    elif opcode == Opcode.METADATA_INDEX:
        file.metadata.append(MetadataIndex.read(body_stream(body)))
    else:
        file.add_definition(opcode, body)


def _is_complete(summary: McapFile, statistics: Statistics) -> bool:
    """Whether a summary lists everything in the data section."""
    return (
        statistics.chunk_count == len(summary.pieces)
        and (statistics.chunk_count > 0 or statistics.message_count == 0)
        and statistics.attachment_count == len(summary.attachments)
        and statistics.metadata_count == len(summary.metadata)
        and statistics.channel_count == len(summary.channels)
        and statistics.channel_message_counts.keys() <= summary.channels.keys()
        and all(summary.is_defined(channel) for channel in summary.channels.values())
    )
