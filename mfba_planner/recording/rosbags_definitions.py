# SPDX-License-Identifier: Apache-2.0
"""Message definitions as ros2msg text, from what rosbags finds in a bag or ships itself."""

from __future__ import annotations

from functools import cache

from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from .message_definitions import Definition

_HEADER = "std_msgs/msg/Header"
_IDL_SEPARATOR = "=" * 80 + "\n"


def definition_of_connection(connection: Connection) -> Definition:
    """The definition of a connection's type; its text is empty where none is known.

    sqlite3 files hold definitions since Iron only: before, the types of Humble are taken.
    """
    name, stored = connection.msgtype, connection.msgdef
    if stored.format is MessageDefinitionFormat.MSG:
        return Definition(name, stored.data, connection.digest)
    try:
        store = (
            idl_store(stored.data)
            if stored.format is MessageDefinitionFormat.IDL
            else get_typestore(Stores.ROS2_HUMBLE)
        )
        return Definition(name, msg_text(store, name), connection.digest or type_hash(store, name))
    except Exception:  # of many kinds, for any flaw of a foreign definition
        return Definition(name, "", connection.digest)


@cache
def idl_store(text: str) -> Typestore:
    """A type store of a ros2idl schema. Raises any error for text that is not IDL."""
    store = get_typestore(Stores.EMPTY)
    for part in text.split(_IDL_SEPARATOR):
        head, _, body = part.partition("\n")
        store.register(get_types_from_idl(body if head.startswith("IDL: ") else part))
    return store


def ros1_store(connection: Connection) -> Typestore:
    """A type store of the definition that a ROS 1 connection holds, with the Header of ROS 2."""
    types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
    if _HEADER in types:  # rosbags skips seq itself when it converts
        constants, fields = types[_HEADER]
        types[_HEADER] = constants, [field for field in fields if field[0] != "seq"]
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def type_hash(store: Typestore, type_name: str) -> str:
    """The RIHS01 hash of a type of a store. Raises any error for an unknown type."""
    return str(store.hash_rihs01(type_name))


def msg_text(store: Typestore, type_name: str) -> str:
    """The ros2msg text of a type of a store. Raises TypesysError."""
    return store.generate_msgdef(type_name, ros_version=2)[0]
