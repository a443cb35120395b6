# SPDX-License-Identifier: Apache-2.0
"""A ROS 1 bag, read through rosbags (the extra `bags`): its messages are converted to CDR."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader
from rosbags.typesys.store import Typestore

from .bag_qos import OfferedQos, to_list
from .library_file import LibraryFile
from .message_definitions import Definition
from .rosbags_definitions import msg_text, ros1_store, type_hash
from .storage_file import StoredMessage, StoredTopic

# Types of ROS 1 whose successor in ROS 2 has the same content under another name.
_RENAMED = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}


def open_file(path: Path, shown: Path, *, salvage: bool) -> Ros1File:
    """Open a file, named `shown` in messages. Raises BagError."""
    return Ros1File(path, shown, salvage=salvage)


class Ros1File(LibraryFile):
    """An open file; a latched publisher becomes a transient local one."""

    kind = "ROS 1"

    def open(self) -> None:
        """Open the file and read its index."""
        self._reader = Reader(self.source)
        self._reader.open()
        self._connections: dict[int, Connection] = {c.id: c for c in self._reader.connections}
        self._stores: dict[int, Typestore] = {}
        if self._reader.message_count:
            self.bounds_ns = self._reader.start_time, self._reader.end_time - 1

    def topics(self) -> list[StoredTopic]:
        """All topics; one whose definition cannot be read is of encoding ros1."""
        return [self._topic(number, c) for number, c in self._connections.items()]

    def _topic(self, number: int, connection: Connection) -> StoredTopic:
        name = _RENAMED.get(connection.msgtype, connection.msgtype)
        encoding, text, hashed = "cdr", "", ""
        try:
            self._stores[number] = ros1_store(connection)
            text = msg_text(self._stores[number], connection.msgtype)
            hashed = type_hash(self._stores[number], connection.msgtype)
        except Exception:  # of many kinds, for any flaw of a foreign definition
            encoding = "ros1"
        latched = bool(getattr(connection.ext, "latching", 0))
        durability = "transient_local" if latched else "volatile"
        return StoredTopic(
            channel_id=number,
            name=connection.topic,
            encoding=encoding,
            definition=Definition(name, text, hashed),
            offered_qos=to_list([OfferedQos(durability=durability)]),
            message_count=connection.msgcount,
        )

    def read(self, channel_ids: frozenset[int]) -> Iterator[StoredMessage]:
        """The messages of these channels as CDR, by log time."""
        wanted = [c for number, c in self._connections.items() if number in channel_ids]
        if not wanted:
            return
        for index, (connection, time_ns, data) in enumerate(self._reader.messages(wanted)):
            cdr = self._stores[connection.id].ros1_to_cdr(data, connection.msgtype)
            yield StoredMessage(connection.id, index & 0xFFFFFFFF, time_ns, time_ns, bytes(cdr))

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
