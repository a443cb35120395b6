# SPDX-License-Identifier: Apache-2.0
"""Write files and directories completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from ..core.errors import OutputError


class WholeWriteFile:
    """A new unbuffered file; a write that fails is undone, so the file ends at a whole write."""

    def __init__(self, path: Path) -> None:
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115  (stays open with the writer)
        self._offset = 0

    def write(self, data: bytes) -> int:
        """Write all of `data`, or nothing and raise."""
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
        """Does nothing: writes are not buffered."""

    def close(self) -> None:
        """Sync to disk and close; a second call does nothing."""
        if not self._file.closed:
            try:
                os.fsync(self._file.fileno())
            finally:
                self._file.close()


def make_directory(directory: Path) -> list[Path]:
    """Make a new directory and its missing parents; return those made, innermost first.

    Raises OutputError if it exists or cannot be made; then no directory is left behind.
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
        raise creation_error(directory, error) from error
    return made


def creation_error(directory: Path, error: OSError) -> OutputError:
    """The OutputError for a directory that cannot be created."""
    return OutputError(
        f"{directory}: cannot be created ({error.strerror}); "
        "choose a new directory where you may write, with enough free space"
    )


def remove_empty(directories: Iterable[Path]) -> None:
    """Remove the empty ones among these directories, given innermost first."""
    for directory in directories:
        with suppress(OSError):
            directory.rmdir()


def write_atomically(path: Path, text: str) -> None:
    """Write a text file completely or not at all, also in case of a power cut."""
    temporary = path.with_name(f".{path.name}.part")
    try:
        with open(temporary, "x", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    directory = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)
