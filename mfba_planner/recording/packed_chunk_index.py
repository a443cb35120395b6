# SPDX-License-Identifier: Apache-2.0
"""The index of a bag in a tenth of the memory: a recorder keeps it until the end."""

from __future__ import annotations

from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.writer import Writer


class _PackedRecord:
    """A record as it is written: 270 bytes for 16 topics, instead of 3 kB of objects."""

    __slots__ = ("_data",)

    def __init__(self, data: bytes) -> None:
        self._data = data

    def write(self, builder: RecordBuilder) -> None:
        """Append the record, as mcap's own records do."""
        builder.write(self._data)


def pack_last_chunk_index(writer: Writer) -> None:
    """Replace the index of the chunk that a writer has just ended by its bytes.

    A writer that keeps it elsewhere than mcap 1.5 and 1.6 do is left as it is.
    """
    kept: list[Any] = getattr(writer, "_Writer__chunk_indices", [])
    if kept and isinstance(kept[-1], ChunkIndex):
        builder = RecordBuilder()
        kept[-1].write(builder)
        kept[-1] = _PackedRecord(builder.end())
