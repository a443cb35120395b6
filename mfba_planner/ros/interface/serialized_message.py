# SPDX-License-Identifier: Apache-2.0
"""Type name, header and stamp of a message class or a serialized message, without decoding."""

from __future__ import annotations

import struct
from typing import Any

from ...recording.from_messages import SECOND_NS

_STAMP = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}
_ENCAPSULATION_BYTES = 4  # the second is the byte order


def type_name(message_type: Any) -> str:
    """Name of a message class: package/msg/Name."""
    return f"{message_type.__module__.split('.')[0]}/msg/{message_type.__name__}"


def has_header(message_type: Any) -> bool:
    """Whether the first field of a message class is a std_msgs/Header."""
    fields = message_type.get_fields_and_field_types()
    return next(iter(fields.items())) == ("header", "std_msgs/Header")


def header_stamp_ns(data: bytes) -> int:
    """Stamp (ns) of a message whose first field is a Header, from its CDR bytes."""
    return clock_ns(data)  # a Header begins with its stamp


def clock_ns(data: bytes) -> int:
    """Time (ns) of a rosgraph_msgs/Clock, from its CDR bytes."""
    sec, nanosec = _STAMP[data[1] & 1].unpack_from(data, _ENCAPSULATION_BYTES)
    return int(sec) * SECOND_NS + int(nanosec)
