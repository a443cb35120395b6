# SPDX-License-Identifier: Apache-2.0
"""Random changes of plain data, of text and of MCAP files, from a generator that is passed in."""

from __future__ import annotations

import copy
import struct
import zlib
from typing import Any

import numpy as np
import zstandard

Rng = np.random.Generator

_MAGIC = 8
_FRAME = struct.Struct("<BQ")
_CHUNK = 0x06
_ATTACHMENT = 0x09
VALUES: list[Any] = [
    None, True, False, "", "x", " ", "\0", "é", "1e3", "nan", ".inf", "-", "{}", "[]", "../..",
    [], {}, [[]], {"a": 1}, [0.0, 0.0], [0.0] * 40, 0, 1, -1, 2, 10**6, 2**31, 2**63, -(2**63),
    10**400, 0.0, -0.0, 1e-320, 1e-9, 0.5, 1e9, 1e308, -1e308, float("nan"), float("inf"),
    float("-inf"), "a" * 5000,
]  # fmt: skip
_TOKENS = [
    "\0", "\t", "\n", "{", "}", "[", "]", ": ", "- ", "&a ", "*a", "!!python/name:os.system ", "|",
    "<<: ", "%", "#", "'", '"', "\ufeff", "\u2028", "é", ".nan", "1e999", "---\n", "? ",
]  # fmt: skip


def pick(rng: Rng, choices: Any) -> Any:
    """One of the choices."""
    return choices[int(rng.integers(len(choices)))]


def changed_data(rng: Rng, data: Any) -> Any:
    """A copy of nested lists and mappings with one to three changes."""
    data = copy.deepcopy(data)
    for _ in range(int(rng.integers(1, 4))):
        holders = [holder for holder in _holders(data) if len(holder)]
        if not holders:
            return pick(rng, VALUES)
        holder = pick(rng, holders)
        key = (
            pick(rng, list(holder)) if isinstance(holder, dict) else int(rng.integers(len(holder)))
        )
        kind = rng.integers(12)
        if kind > 5:  # most often a value that may still be good
            if _is_moderate(holder[key]):
                holder[key] = float(
                    holder[key] + rng.normal() * pick(rng, [1e-9, 0.1, 1.0, 100.0])
                )
        elif kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[str(pick(rng, VALUES))] = holder.pop(key)
        elif kind == 1:
            holder.insert(key, copy.deepcopy(holder[key]))
        elif kind == 2 and _is_moderate(holder[key]):
            holder[key] = holder[key] * pick(rng, [-1, 0, 1e-6, 10, 1e6]) + pick(rng, [0, 1e-9, 1])
        elif kind == 3:
            holder[key] = [copy.deepcopy(holder[key])] * int(pick(rng, [1, 2, 50]))
        else:
            holder[key] = copy.deepcopy(pick(rng, VALUES))
    return data


def _is_moderate(value: Any) -> bool:
    """Whether it is a number that arithmetic with floats does not refuse."""
    return isinstance(value, (int, float)) and abs(value) < 1e300


def _holders(data: Any) -> list[Any]:
    if not isinstance(data, (dict, list)):
        return []
    values = data.values() if isinstance(data, dict) else data
    return [data, *(holder for value in values for holder in _holders(value))]


def changed_bytes(rng: Rng, data: bytes) -> bytes:
    """The bytes with one to three flips, cuts, repeats or insertions."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(changed) + 1))
        size = int(rng.integers(1, 1 + pick(rng, [2, 20, 200])))
        kind = rng.integers(5)
        if kind == 0:
            del changed[at : at + size]
        elif kind == 1:
            changed[at:at] = changed[at : at + size]
        elif kind == 2:
            changed[at:at] = pick(rng, _TOKENS).encode()
        elif kind == 3 and at < len(changed):
            changed[at] = int(rng.integers(256))
        else:
            del changed[at:]
    return bytes(changed)


def changed_mcap(rng: Rng, data: bytes) -> bytes:
    """An MCAP file with a change of its records, of one record's bytes, or within a chunk."""
    records = _records(data[_MAGIC:-_MAGIC])
    at = int(rng.integers(len(records)))
    opcode, body = records[at]
    kind = rng.integers(7)
    if kind == 0:
        del records[at]
    elif kind == 1:
        records.insert(int(rng.integers(len(records))), (opcode, body))
    elif kind == 2:
        records[at] = (int(rng.integers(256)), body)
    elif kind == 3:
        return changed_bytes(rng, data)
    elif kind == 4:
        records[at] = (opcode, changed_bytes(rng, body))
    else:
        wanted = _CHUNK if kind == 5 else _ATTACHMENT
        places = [i for i, (code, _) in enumerate(records) if code == wanted]
        if places:
            at = pick(rng, places)
            change = _changed_chunk if wanted == _CHUNK else _changed_attachment
            records[at] = (wanted, change(rng, records[at][1]))
    packed = b"".join(_FRAME.pack(code, len(body)) + body for code, body in records)
    return data[:_MAGIC] + packed + data[-_MAGIC:]


def _records(data: bytes) -> list[tuple[int, bytes]]:
    found, at = [], 0
    while at + _FRAME.size <= len(data):
        opcode, size = _FRAME.unpack_from(data, at)
        at += _FRAME.size
        found.append((opcode, data[at : at + size]))
        at += size
    return found


def _changed_chunk(rng: Rng, body: bytes) -> bytes:
    """Change records within a chunk; its size and checksum are right again."""
    (text_size,) = struct.unpack_from("<I", body, 28)
    name_end = 32 + text_size
    (size,) = struct.unpack_from("<Q", body, name_end)
    packed = body[name_end + 8 : name_end + 8 + size]
    compression = body[32:name_end]
    plain = zstandard.ZstdDecompressor().decompress(packed) if compression == b"zstd" else packed
    records = _records(plain)
    at = int(rng.integers(len(records)))
    opcode, inner = records[at]
    kind = rng.integers(4)
    if kind == 0:
        del records[at]
    elif kind == 1:
        records.insert(int(rng.integers(len(records))), (opcode, inner))
    else:
        records[at] = (opcode, changed_bytes(rng, inner))
    plain = b"".join(_FRAME.pack(code, len(inner)) + inner for code, inner in records)
    packed = zstandard.ZstdCompressor().compress(plain) if compression == b"zstd" else plain
    head = body[:16] + struct.pack("<QI", len(plain), zlib.crc32(plain))
    return head + body[28:name_end] + struct.pack("<Q", len(packed)) + packed


def _changed_attachment(rng: Rng, body: bytes) -> bytes:
    """Change an attachment; its checksum is right again."""
    changed = changed_bytes(rng, body[:-4])
    return changed + struct.pack("<I", zlib.crc32(changed))
