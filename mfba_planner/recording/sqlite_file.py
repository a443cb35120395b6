# SPDX-License-Identifier: Apache-2.0
"""A sqlite3 (.db3) storage file, read through rosbags (the extra `bags`)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import cast

from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.metadata import dump_qos_v9

from ..core.errors import BagError
from .library_file import LibraryFile
from .rosbags_definitions import definition_of_connection
from .storage_file import StoredMessage, StoredTopic

_SUFFIX = ".db3"  # by which rosbags knows the format


def open_file(path: Path, shown: Path, *, salvage: bool) -> SqliteFile:
    """Open a file, named `shown` in messages. Raises BagError."""
    if path.suffix != _SUFFIX:
        raise BagError(f"{shown}: a sqlite3 bag; rename it so that it ends in {_SUFFIX}")
    file = SqliteFile(path, shown, salvage=salvage)
    for journal in ("-wal", "-journal"):
        left = path.with_name(path.name + journal)
        if left.exists() and left.stat().st_size:
            text = (
                f"{left.name} holds messages that are not in the file yet "
                "(the recording was not closed)"
            )
            if not salvage:
                file.close()
                raise BagError(
                    f"{shown}: {text}; run `sqlite3 {shown} 'pragma wal_checkpoint(truncate)'`, "
                    "or `mfba recover` for the rest"
                )
            file.damage.append(text)
    return file


class SqliteFile(LibraryFile):
    """An open file; its messages are read one by one, by the index on their times."""

    kind = "sqlite3"

    def open(self) -> None:
        """Open the database and read its tables, except for the messages."""
        self._reader = Reader(self.source)
        self._reader.open()
        self._connections: dict[int, Connection] = {c.id: c for c in self._reader.connections}
        if self._reader.message_count:
            self.bounds_ns = self._reader.start_time, self._reader.end_time - 1

    def topics(self) -> list[StoredTopic]:
        """All topics of the file."""
        found = []
        for number, connection in self._connections.items():
            stored = cast(ConnectionExtRosbag2, connection.ext)
            topic = StoredTopic(
                channel_id=number,
                name=connection.topic,
                encoding=stored.serialization_format,
                definition=definition_of_connection(connection),
                offered_qos=dump_qos_v9(stored.offered_qos_profiles),
                message_count=connection.msgcount,
            )
            found.append(topic)
        return found

    def read(self, channel_ids: frozenset[int]) -> Iterator[StoredMessage]:
        """The messages of these channels, by log time."""
        wanted = [c for number, c in self._connections.items() if number in channel_ids]
        if not wanted:
            return
        for index, (connection, time_ns, data) in enumerate(self._reader.messages(wanted)):
            yield StoredMessage(connection.id, index & 0xFFFFFFFF, time_ns, time_ns, bytes(data))

    def close(self) -> None:
        """Close the database."""
        self._reader.close()
