# SPDX-License-Identifier: Apache-2.0
"""Check the data section of a closed MCAP file against its CRC."""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path

from mcap.opcode import Opcode

from ..core.errors import BagError
from ..core.input_files import open_input
from .mcap_records import MAGIC

_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, offset start, summary CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC of all bytes before (0: none)
_BLOCK_BYTES = 1 << 20
_REMEDY = "copy it again from where it was recorded"


def check_data(path: Path, shown: Path | None = None) -> bool:
    """Compare the data section of a closed file with its CRC; False if the file has none.

    Raises BagError on a mismatch, which names the file `shown`. Holds one block in memory.
    """
    name = shown or path
    with open_input(path) as stream:
        size = stream.seek(0, os.SEEK_END)
        tail_bytes = _FOOTER.size + len(MAGIC)
        stream.seek(max(0, size - tail_bytes))
        _, _, summary_start, _, _ = _FOOTER.unpack(stream.read(_FOOTER.size))
        end = (summary_start or size - tail_bytes) - _DATA_END.size
        stream.seek(end)
        opcode, _, stored = _DATA_END.unpack(stream.read(_DATA_END.size))
        if opcode != Opcode.DATA_END:
            raise BagError(
                f"{name}: its data section does not end at the position in its index; {_REMEDY}"
            )
        if not stored:
            return False
        stream.seek(0)
        crc, left = 0, end
        while left:
            block = stream.read(min(left, _BLOCK_BYTES))
            crc, left = zlib.crc32(block, crc), left - len(block)
    if crc != stored:
        raise BagError(
            f"{name}: its data section has CRC {crc:08x}, not {stored:08x}: at least one bit "
            f"has changed since the recording; {_REMEDY}"
        )
    return True
