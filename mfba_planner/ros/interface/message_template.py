# SPDX-License-Identifier: Apache-2.0
"""A message serialized once, of which a few numbers are replaced before each publication."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

_FORMATS = {
    "double": "d",
    "float": "f",
    "int32": "i",
    "uint32": "I",
    "sequence<float>": "f",
    "sequence<uint8>": "B",
}


class MessageTemplate:
    """Serializes messages of one type that differ in the values of some numeric fields.

    To construct and to serialize a message object takes tens of microseconds, most of them for
    what is always the same. Where a field is in the bytes is found by serializing a mark in its
    place, so nothing here depends on the layout.
    """

    def __init__(self, message: Any, fields: Sequence[str]) -> None:
        """Take all else from a message; fields are paths such as "poses.0.position.x".

        Of a sequence the present number of elements is replaced.
        """
        marked = deserialize_message(serialize_message(message), type(message))
        marks = [_mark(marked, path, number) for number, path in enumerate(fields)]
        data = serialize_message(marked)
        order = "<" if data[1] & 1 else ">"
        self._data = bytearray(data)
        self._parts: list[tuple[struct.Struct, int, slice]] = []
        first, start, end, text = 0, 0, -1, ""
        count = 0
        for form, values in marks:
            pattern = struct.pack(order + form, *values)
            at = _only_place(data, pattern)
            if at != end and text:  # not the neighbour of the one before
                self._parts.append((struct.Struct(order + text), start, slice(first, count)))
                text = ""
            if not text:
                first, start = count, at
            text, end, count = text + form, at + len(pattern), count + len(values)
        self._parts.append((struct.Struct(order + text), start, slice(first, count)))
        self._count = count

    def fill(self, values: Sequence[float]) -> bytes:
        """The serialized message with these values, in the sequence of the fields."""
        data = self._data
        for part, start, of_part in self._parts:
            part.pack_into(data, start, *values[of_part])
        return bytes(data)


def _mark(message: Any, path: str, number: int) -> tuple[str, Sequence[float]]:
    """Set a field to values that are found nowhere else; return their format and them."""
    *owners, name = path.split(".")
    for owner in owners:
        message = message[int(owner)] if owner.isdigit() else getattr(message, owner)
    kind = message.get_fields_and_field_types()[name]
    form = _FORMATS[kind]
    if form == "d":
        value: float = 1e200 * (1.0 + number / 1024.0)
    elif form == "f":
        value = 2.0**100 * (1.0 + number / 1024.0)  # exact in single precision
    else:
        value = 0x5A010203 + 7 * number
    if not kind.startswith("sequence"):
        setattr(message, name, value)
        return form, [value]
    array = getattr(message, name)
    for k in range(len(array)):
        array[k] = (number + 100 + k) % 256 if form == "B" else value * (1.0 + k / 1024.0)
    return form * len(array), array


def _only_place(data: bytes, pattern: bytes) -> int:
    assert data.count(pattern) == 1, f"{pattern!r} is not found once"
    return data.index(pattern)
