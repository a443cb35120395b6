# SPDX-License-Identifier: Apache-2.0
"""Parse and check MCAP records from bytes: frames, messages, chunks, attachments."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk
from mcap.stream_reader import get_chunk_data_stream

from ..core.errors import BagError
from .storage_file import StoredMessage

# First and last bytes of every file. mcap.writer has it too, but its import is slow.
MAGIC = b"\x89MCAP0\r\n"
FRAME = struct.Struct("<BQ")  # opcode, length of the body
_MESSAGE = struct.Struct("<HIQQ")  # channel id, sequence, log time, publish time

# mcap does not check its input: broken bytes raise any of these.
_PARSE_ERRORS = (
    McapError,
    ValueError,
    KeyError,
    RuntimeError,
    MemoryError,
    OverflowError,
    struct.error,
    zstandard.ZstdError,
)


@contextmanager
def reading(path: Path, what: str) -> Iterator[None]:
    """Convert the errors of broken bytes or a failing disk in the body into a BagError."""
    try:
        yield
    except OSError as error:
        raise BagError(
            f"{path}: cannot be read ({error.strerror}); copy it to a sound disk"
        ) from error
    except _PARSE_ERRORS as error:
        reason = str(error).split("\n")[0] or type(error).__name__
        raise BagError(
            f"{path}: damaged, {what} cannot be read ({reason}); run `mfba recover {path}`"
        ) from error


def body_stream(body: bytes) -> ReadDataStream:
    """A record's body as the stream that the `read` functions of mcap.records expect."""
    return ReadDataStream(BytesIO(body))


def frames(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(opcode, start, end) of each record's body in `data`. Raises ValueError, struct.error."""
    position = 0
    while position < len(data):
        opcode, length = FRAME.unpack_from(data, position)
        start = position + FRAME.size
        position = start + length
        if position > len(data):
            raise ValueError(f"a record of {length} bytes runs over the end")
        yield opcode, start, position


def messages(data: bytes) -> list[StoredMessage]:
    """The messages among the records of `data`, in the same sequence."""
    return [
        StoredMessage._make(
            (*_MESSAGE.unpack_from(data, start), data[start + _MESSAGE.size : end])
        )
        for opcode, start, end in frames(data)
        if opcode == Opcode.MESSAGE
    ]


def chunk_data(body: bytes) -> bytes:
    """The records in a chunk, uncompressed. Checks size and CRC."""
    chunk = Chunk.read(body_stream(body))
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    if length != chunk.uncompressed_size:
        raise ValueError(f"a chunk of {length} bytes instead of {chunk.uncompressed_size}")
    return stream.read(length)


def attachment(body: bytes) -> Attachment:
    """An attachment. Checks the CRC, which mcap ignores; raises ValueError."""
    stored = int.from_bytes(body[-4:], "little")
    if stored not in (0, zlib.crc32(body[:-4])):
        raise ValueError("wrong CRC")
    return Attachment.read(body_stream(body))
