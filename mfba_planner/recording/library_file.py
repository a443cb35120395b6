# SPDX-License-Identifier: Apache-2.0
"""A storage file that a library reads message by message, sorted by log time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path

from mcap.records import Attachment, AttachmentIndex, MetadataIndex

from ..core.errors import BagError
from .storage_file import Span, StoredMessage, StoredTopic


class LibraryFile(ABC):
    """Base of these files: they have neither attachments nor checksums.

    With `salvage` reading ends at the first message that cannot be read.
    """

    kind = ""

    def __init__(self, source: Path, shown: Path, *, salvage: bool) -> None:
        self.source, self.path, self.salvage = source, shown, salvage
        self.size = shown.stat().st_size
        self.attachments: list[AttachmentIndex] = []
        self.metadata: list[MetadataIndex] = []
        self.damage: list[str] = []
        self.bytes_lost = 0
        self.complete = True
        self.bounds_ns: tuple[int, int] | None = None
        try:
            self.open()
        except Exception as error:  # the library's, its parsers' and its database's
            raise self._unreadable(error) from error

    @abstractmethod
    def open(self) -> None:
        """Open the file and set bounds_ns, the first and the last log time. Raises any error."""

    @abstractmethod
    def topics(self) -> list[StoredTopic]:
        """All topics of the file."""

    @abstractmethod
    def read(self, channel_ids: frozenset[int]) -> Iterator[StoredMessage]:
        """The messages of these channels, by log time. Raises any error."""

    @abstractmethod
    def close(self) -> None:
        """Close the file."""

    def spans(self) -> Iterator[Span]:
        """The file as one part, none without messages."""
        if self.bounds_ns:
            yield Span(*self.bounds_ns, self._load, is_sorted=True)

    def _load(self, channel_ids: frozenset[int]) -> Iterator[StoredMessage]:
        messages = self.read(channel_ids)
        while True:
            try:
                message = next(messages, None)
            except Exception as error:  # as in open()
                if not self.salvage:
                    raise self._unreadable(error) from error
                self.damage.append(f"{self.path.name}: the rest cannot be read ({error})")
                return
            if message is None:
                return
            yield message

    def _unreadable(self, error: Exception) -> BagError:
        reason = (str(error) or type(error).__name__).split("\n")[0]
        return BagError(
            f"{self.path}: damaged, cannot be read as {self.kind} ({reason}); "
            "copy it again from where it was recorded, or run `mfba recover`"
        )

    def attachment(self, index: AttachmentIndex) -> Attachment:
        """There is none."""
        raise KeyError(index.name)

    def metadata_record(self, index: MetadataIndex) -> dict[str, str]:
        """There is none."""
        raise KeyError(index.name)

    def check(self) -> None:
        """Nothing to compare: these formats have no checksum."""
        return
