# SPDX-License-Identifier: Apache-2.0
"""Index an MCAP file record by record, for files without a summary, an index, or an end.

Every record is framed by an opcode and a length, so what is whole can be told from what is not.
"""

from __future__ import annotations

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Metadata, MetadataIndex

from ..core.errors import BagError
from . import mcap_records
from .mcap_file import McapFile, Piece
from .mcap_records import FRAME, MAGIC, Message, reading

_LOOSE_RUN_BYTES = 1 << 20  # messages outside chunks are handled in runs of about this size


def walk(file: McapFile, *, salvage: bool) -> None:
    """Fill the index up to the last whole record.

    What cannot be read is noted in `file.damage` when salvaging; otherwise raises BagError.
    """
    _Walk(file, salvage).run()


class _Walk:
    def __init__(self, file: McapFile, salvage: bool) -> None:
        self.file = file
        self.salvage = salvage
        self.end = file.size - (len(MAGIC) if file.complete else 0)
        self.in_data = True
        self.loose: list[Message] = []
        self.loose_offset = 0

    def run(self) -> None:
        position = len(MAGIC)
        while position < self.end:
            opcode, after = self._frame(position)
            if opcode == 0 or after > self.end:
                if self.in_data:
                    self._give_up(position, self.end, "no whole record")
                break
            try:
                with reading(self.file.path, f"the record at byte {position}"):
                    self._record(opcode, position, after)
            except BagError:
                self._end_loose(position)
                self._give_up(position, after, "a record that cannot be read")
            position = after
        self._end_loose(position)
        self._drop_undefined()

    def _frame(self, position: int) -> tuple[int, int]:
        """Opcode (0 for none) and end of the record at `position`."""
        if position + FRAME.size > self.end:
            return 0, self.end
        opcode, length = FRAME.unpack(self.file.bytes_at(position, FRAME.size))
        return opcode, position + FRAME.size + length

    def _record(self, opcode: int, position: int, after: int) -> None:
        file = self.file
        if opcode == Opcode.MESSAGE:
            self._loose_message(position, after)
            return
        self._end_loose(position)
        if opcode == Opcode.DATA_END:
            self.in_data = False
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            # In the summary too: a topic without any message may stand there alone.
            file.define(opcode, file.body(position, opcode))
        elif opcode == Opcode.CHUNK:
            self._chunk(position, after)
        elif opcode == Opcode.ATTACHMENT:
            found = mcap_records.attachment(file.body(position, opcode))
            file.attachments.append(
                AttachmentIndex(
                    offset=position,
                    length=after - position,
                    log_time=found.log_time,
                    create_time=found.create_time,
                    data_size=len(found.data),
                    name=found.name,
                    media_type=found.media_type,
                )
            )
        elif opcode == Opcode.METADATA:
            name = Metadata.read(mcap_records.parsed(file.body(position, opcode))).name
            file.metadata.append(
                MetadataIndex(offset=position, length=after - position, name=name)
            )

    def _chunk(self, position: int, after: int) -> None:
        data = mcap_records.chunk_data(self.file.body(position, Opcode.CHUNK))
        for opcode, start, end in mcap_records.frames(data):
            if opcode != Opcode.MESSAGE:
                self.file.define(opcode, data[start:end])
        self._piece(mcap_records.messages(data), position, after, is_chunk=True)

    def _loose_message(self, position: int, after: int) -> None:
        if self.loose and after - self.loose_offset > _LOOSE_RUN_BYTES:
            self._end_loose(position)
        if not self.loose:
            self.loose_offset = position
        self.loose += mcap_records.messages(self.file.bytes_at(position, after - position))

    def _end_loose(self, position: int) -> None:
        self._piece(self.loose, self.loose_offset, position, is_chunk=False)
        self.loose = []

    def _piece(self, messages: list[Message], start: int, end: int, *, is_chunk: bool) -> None:
        if messages:
            times = [message.log_time_ns for message in messages]
            self.file.counts.update(message.channel_id for message in messages)
            self.file.pieces.append(Piece(start, end - start, min(times), max(times), is_chunk))

    def _drop_undefined(self) -> None:
        """What a damaged chunk defined is gone for the messages of later chunks too."""
        file = self.file
        file.channels = {k: c for k, c in file.channels.items() if file.is_defined(c)}
        for channel_id in [k for k in file.counts if k not in file.channels]:
            count = file.counts.pop(channel_id)
            self._note(f"{count} messages of channel {channel_id}, which is not described")

    def _give_up(self, start: int, end: int, reason: str) -> None:
        self.file.bytes_lost += end - start
        self._note(f"{end - start} bytes at byte {start}: {reason}")

    def _note(self, damage: str) -> None:
        if not self.salvage:
            raise BagError(
                f"{self.file.path}: damaged, {damage}; run `mfba recover {self.file.path}`"
            )
        self.file.damage.append(f"{self.file.path.name}: lost {damage}")
