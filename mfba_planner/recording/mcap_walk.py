# SPDX-License-Identifier: Apache-2.0
"""Index an MCAP file record by record, for files without a summary, an index, or an end.

Every record starts with an opcode and a length, so whole records can be found in damaged files.
"""

from __future__ import annotations

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Metadata, MetadataIndex

from ..core.errors import BagError
from . import mcap_records
from .mcap_file import McapFile, Piece
from .mcap_records import FRAME, MAGIC, reading
from .storage_file import StoredMessage

_UNCHUNKED_RUN_BYTES = 1 << 20  # messages outside chunks are indexed in runs of about this size


def walk(file: McapFile, *, salvage: bool) -> None:
    """Fill the index up to the last whole record.

    Records that cannot be read are listed in `file.damage` if salvaging, else raise BagError.
    """
    _RecordWalk(file, salvage).run()


class _RecordWalk:
    def __init__(self, file: McapFile, salvage: bool) -> None:
        self.file = file
        self.salvage = salvage
        self.end = file.size - (len(MAGIC) if file.complete else 0)
        self.in_data = True
        self.unchunked: list[StoredMessage] = []
        self.unchunked_offset = 0

    def run(self) -> None:
        offset = len(MAGIC)
        while offset < self.end:
            opcode, next_offset = self._frame(offset)
            if opcode == 0 or next_offset > self.end:
                if self.in_data:
                    self._skip(offset, self.end, "no whole record")
                break
            try:
                with reading(self.file.path, f"the record at byte {offset}"):
                    self._add_record(opcode, offset, next_offset)
            except BagError:
                self._end_unchunked_run(offset)
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
