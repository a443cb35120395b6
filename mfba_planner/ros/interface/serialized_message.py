# SPDX-License-Identifier: Apache-2.0
"""What can be told from a message class or a serialized message without decoding it."""

from __future__ import annotations

import struct
from typing import Any

from ...recording.from_messages import SECOND_NS

_STAMP = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}
_ENCAPSULATION_BYTES = 4  # of which the second says the byte order


def type_name(kind: Any) -> str:
    """Name of a message class: package/msg/Name."""
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def has_header(kind: Any) -> bool:
    """Whether a message class begins with a std_msgs/Header."""
    return next(iter(kind.get_fields_and_field_types().items())) == ("header", "std_msgs/Header")


def header_stamp_ns(data: bytes) -> int:
    """Stamp (ns) of a message that begins with a Header, from its CDR bytes."""
    sec, nanosec = _STAMP[data[1] & 1].unpack_from(data, _ENCAPSULATION_BYTES)
    return int(sec) * SECOND_NS + int(nanosec)
