# SPDX-License-Identifier: Apache-2.0
"""Files and directories that are there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from ..core.errors import OutputError


class WholeWrites:
    """A new unbuffered file that ends at a whole write, also after one has failed."""

    def __init__(self, path: Path) -> None:
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115  (open as long as the writer)
        self._offset = 0

    def write(self, data: bytes) -> int:
        """Write all of `data` or, raising, nothing of it."""
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
        except BaseException:
            with suppress(OSError):
                self._file.truncate(self._offset)
            raise
        self._offset += len(data)
        return len(data)

    def tell(self) -> int:
        """Bytes written so far."""
        return self._offset

    def flush(self) -> None:
        """Nothing is held back: each write went to the system."""

    def close(self) -> None:
        """Bring everything to the disk and close; a second call does nothing."""
        if not self._file.closed:
            try:
                os.fsync(self._file.fileno())
            finally:
                self._file.close()


def make_directory(directory: Path) -> list[Path]:
    """Make a new directory and its missing parents; what was made, innermost first.

    Raises OutputError, with nothing left behind, where it exists or cannot be made.
    """
    missing = [directory]
    while not os.path.lexists(missing[-1].parent):
        missing.append(missing[-1].parent)
    made: list[Path] = []
    try:
        for path in reversed(missing):
            path.mkdir()
            made.insert(0, path)
    except OSError as error:
        remove_empty(made)
        if isinstance(error, FileExistsError):
            raise OutputError(
                f"{directory}: exists already and is never overwritten; choose a new directory"
            ) from error
        raise cannot_create(directory, error) from error
    return made


def cannot_create(directory: Path, error: OSError) -> OutputError:
    """The error for a directory that cannot be begun."""
    return OutputError(
        f"{directory}: cannot be created ({error.strerror}); "
        "choose a new directory where you may write and there is room"
    )


def remove_empty(directories: Iterable[Path]) -> None:
    """Remove directories, innermost first, as far as they are empty."""
    for directory in directories:
        with suppress(OSError):
            directory.rmdir()


def write_whole(path: Path, text: str) -> None:
    """Write a text file that is there whole or not at all, also after a power cut."""
    draft = path.with_name(f".{path.name}.part")
    try:
        with open(draft, "x", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(draft, path)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    directory = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)
