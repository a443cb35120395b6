# SPDX-License-Identifier: Apache-2.0
"""Index an MCAP file record by record, for files without a summary, an index, or an end.

Every record starts with an opcode and a length, so whole records can be found in damaged files.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Metadata, MetadataIndex

from ..core.errors import BagError
from . import mcap_records
from .mcap_file import McapFile, Piece
from .mcap_records import FRAME, MAGIC, reading
from .storage_file import StoredMessage

_UNCHUNKED_RUN_BYTES = 1 << 20  # messages outside chunks are indexed in runs of about this size


_BLOCK_BYTES = 1 << 20
# How a chunk starts: opcode, length below 2**32, two times, size below 2**32, CRC, compression.
# Other bytes look like this by chance once in 2**100.
_CHUNK_START = re.compile(
    rb"\x06.{4}\0{4}.{16}.{4}\0{4}.{4}(?:\0{4}|\x04\0{3}zstd|\x03\0{3}lz4)", re.DOTALL
)
_CHUNK_START_BYTES = 49
_FIRST_PRIVATE = 0x80  # opcode of records that are not of MCAP
_IN_DATA = (
    Opcode.HEADER,
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.MESSAGE,
    Opcode.CHUNK,
    Opcode.MESSAGE_INDEX,
    Opcode.ATTACHMENT,
    Opcode.METADATA,
    Opcode.DATA_END,
)
_CHECKED = (Opcode.CHUNK, Opcode.ATTACHMENT)  # by a CRC, so that their lengths are right


def walk(file: McapFile, *, salvage: bool, known: Mapping[int, int] | None = None) -> None:
    """Fill the index from all whole records.

    What cannot be read is listed in `file.damage` if salvaging, else raises BagError. Behind it
    the walk goes on at the next record that is known ({offset: opcode}) or the next chunk.
    """
    _RecordWalk(file, salvage, known or {}).run()


class _RecordWalk:
    def __init__(self, file: McapFile, salvage: bool, known: Mapping[int, int]) -> None:
        self.file = file
        self.salvage = salvage
        self.known = known
        self.known_offsets = sorted(known)
        self.end = file.size - (len(MAGIC) if file.complete else 0)
        self.in_data = True
        self.unchecked: int | None = (
            None  # offset of the record before, if its length is unchecked
        )
        self.unchunked: list[StoredMessage] = []
        self.unchunked_offset = 0

    def run(self) -> None:
        offset = len(MAGIC)
        while offset < self.end:
            opcode, next_offset = self._frame(offset)
            if opcode == 0 or next_offset > self.end:
                if not self.in_data:
                    break
                self._end_unchunked_run(offset)
                start = offset if self.unchecked is None else self.unchecked
                next_offset = self._next_record(start + 1)
                lost_from = start if next_offset < offset else offset
                self._skip(lost_from, next_offset, "no whole record")
                offset, self.unchecked = next_offset, None
                continue
            self.unchecked = None if opcode in _CHECKED else offset
            try:
                with reading(self.file.path, f"the record at byte {offset}"):
                    if self.salvage:
                        self._check_opcode(opcode, offset, next_offset)
                    self._add_record(opcode, offset, next_offset)
            except BagError:
                self._end_unchunked_run(offset)
                # Its length may be what is wrong.
                next_offset = min(next_offset, self._next_record(offset + 1))
                self._skip(offset, next_offset, "a record that cannot be read")
            offset = next_offset
        self._end_unchunked_run(offset)
        self._drop_undefined()

    def _frame(self, offset: int) -> tuple[int, int]:
        """Opcode (0 for none) and end of the record at `offset`."""
        if offset + FRAME.size > self.end:
            return 0, self.end
        opcode, length = FRAME.unpack(self.file.bytes_at(offset, FRAME.size))
        return opcode, offset + FRAME.size + length

    def _next_record(self, offset: int) -> int:
        """Where a record is known or a chunk is found at or behind an offset, else the end."""
        known = next((it for it in self.known_offsets if offset <= it < self.end), self.end)
        while self.salvage and offset < known:
            block = self.file.bytes_at(offset, min(_BLOCK_BYTES, self.end - offset))
            if found := _CHUNK_START.search(block):
                return min(known, offset + found.start())
            # A start that the block cuts is whole in the next one.
            offset += max(1, len(block) - _CHUNK_START_BYTES + 1)
        return known

    def _check_opcode(self, opcode: int, offset: int, next_offset: int) -> None:
        """Raise ValueError for a record that is another one, and would be passed over as such."""
        if opcode != self.known.get(offset, opcode):
            raise ValueError(f"record type {opcode} instead of {self.known[offset]}")
        if self.in_data and opcode < _FIRST_PRIVATE and opcode not in _IN_DATA:
            raise ValueError(f"record type {opcode} among the data")
        if opcode == Opcode.MESSAGE_INDEX:  # channel, bytes of its entries, entries
            (length,) = struct.unpack_from("<I", self.file.bytes_at(offset + FRAME.size, 6), 2)
            if offset + FRAME.size + 6 + length != next_offset:
                raise ValueError("an index of another length")

    def _add_record(self, opcode: int, offset: int, next_offset: int) -> None:
        file = self.file
        if opcode == Opcode.MESSAGE:
            self._add_unchunked_message(offset, next_offset)
            return
        self._end_unchunked_run(offset)
        if opcode == Opcode.DATA_END:
            self.in_data = False
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            # Also in the summary: a topic without messages may be described only there.
            file.add_definition(opcode, file.body(offset, opcode))
        elif opcode == Opcode.CHUNK:
            self._add_chunk(offset, next_offset)
        elif opcode == Opcode.ATTACHMENT:
            found = mcap_records.attachment(file.body(offset, opcode))
            file.attachments.append(
                AttachmentIndex(
                    offset=offset,
                    length=next_offset - offset,
                    log_time=found.log_time,
                    create_time=found.create_time,
                    data_size=len(found.data),
                    name=found.name,
                    media_type=found.media_type,
                )
            )
        elif opcode == Opcode.METADATA:
            name = Metadata.read(mcap_records.body_stream(file.body(offset, opcode))).name
            file.metadata.append(
                MetadataIndex(offset=offset, length=next_offset - offset, name=name)
            )

    def _add_chunk(self, offset: int, next_offset: int) -> None:
        data = mcap_records.chunk_data(self.file.body(offset, Opcode.CHUNK))
        for opcode, start, end in mcap_records.frames(data):
            if opcode != Opcode.MESSAGE:
                self.file.add_definition(opcode, data[start:end])
        self._add_piece(mcap_records.messages(data), offset, next_offset, is_chunk=True)

    def _add_unchunked_message(self, offset: int, next_offset: int) -> None:
        if self.unchunked and next_offset - self.unchunked_offset > _UNCHUNKED_RUN_BYTES:
            self._end_unchunked_run(offset)
        if not self.unchunked:
            self.unchunked_offset = offset
        self.unchunked += mcap_records.messages(self.file.bytes_at(offset, next_offset - offset))

    def _end_unchunked_run(self, offset: int) -> None:
        self._add_piece(self.unchunked, self.unchunked_offset, offset, is_chunk=False)
        self.unchunked = []

    def _add_piece(
        self, messages: list[StoredMessage], start: int, end: int, *, is_chunk: bool
    ) -> None:
        if messages:
            times = [message.log_time_ns for message in messages]
            self.file.counts.update(message.channel_id for message in messages)
            self.file.pieces.append(Piece(start, end - start, min(times), max(times), is_chunk))

    def _drop_undefined(self) -> None:
        """Drop channels and messages whose definitions were in a damaged chunk."""
        file = self.file
        file.channels = {k: c for k, c in file.channels.items() if file.is_defined(c)}
        for channel_id in [k for k in file.counts if k not in file.channels]:
            count = file.counts.pop(channel_id)
            self._add_damage(f"{count} messages of channel {channel_id}, which is not described")

    def _skip(self, start: int, end: int, reason: str) -> None:
        self.file.bytes_lost += end - start
        self._add_damage(f"{end - start} bytes at byte {start}: {reason}")

    def _add_damage(self, damage: str) -> None:
        if not self.salvage:
            raise BagError(
                f"{self.file.path}: damaged, {damage}; run `mfba recover {self.file.path}`"
            )
        self.file.damage.append(f"{self.file.path.name}: lost {damage}")
