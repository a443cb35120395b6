# SPDX-License-Identifier: Apache-2.0
"""Writing results: atomic, never overwriting; run directories and the bags in them."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from .errors import ConfigError, OutputError

RESULT = "result.json"  # of a run directory


def new_run_directory(root: Path = Path("runs"), stem: str = "run") -> Path:
    """A directory name below root that is not in use, not created: run-001, run-002, ..."""
    ends = [p.name[len(stem) + 1 :] for p in root.glob(f"{stem}-*")]
    taken = [int(end) for end in ends if end.isdigit()]
    return root / f"{stem}-{max(taken, default=0) + 1:03d}"


def refuse_existing(path: Path) -> Path:
    """Return path, or raise OutputError if it exists."""
    if path.exists() or path.is_symlink():
        raise OutputError(f"{path}: exists and is never overwritten; choose another --out")
    return path


def file_type(kind: str, *suffixes: str) -> Callable[[str], Path]:
    """A `type` of argparse: the path of a file to create, whose suffix says what is written.

    It raises ConfigError for another suffix; upper case is the same.
    """

    def path_of(text: str) -> Path:
        path = Path(text)
        if path.suffix.lower() not in suffixes:
            ends = " or ".join(suffixes)
            raise ConfigError(f"{path}: unknown kind of {kind}; give a name that ends in {ends}")
        return path

    return path_of


def bag_in(path: Path) -> Path:
    """The bag of a run directory; any other path is returned as the bag itself."""
    bag = path / "bag"
    if not os.path.isdir(bag):
        return path
    is_bag = (path / "metadata.yaml").exists() or any(
        any(path.glob(pattern)) for pattern in ("*.mcap*", "*.db3*")
    )
    return path if is_bag else bag


def bag_or_result_in(path: Path) -> Path:
    """The bag of a run directory, or its result where it has no bag; any other path itself."""
    bag = bag_in(path)
    is_bag = bag != path or any(any(path.glob(f"*{end}*")) for end in (".mcap", ".db3", ".bag"))
    return path / RESULT if not is_bag and (path / RESULT).is_file() else bag


def write_new(path: Path, data: bytes) -> None:
    """Write a file that must not exist yet; OutputError as new_file."""
    with new_file(path) as file:
        file.write(data)


def write_same(path: Path, data: bytes) -> None:
    """Write a file, unless it exists with exactly this content; OutputError as new_file."""
    if not (path.is_file() and path.read_bytes() == data):
        write_new(path, data)


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file that must not exist yet; it gets its name after all has been written.

    Raises OutputError when path exists or cannot be written. No file remains after any error.
    """
    if os.path.lexists(path):
        raise _exists(path)
    temporary = path.with_name(f".mfba-{secrets.token_hex(4)}.tmp")
    try:
        try:
            with open(temporary, "xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            _publish(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except FileExistsError:
        raise _exists(path) from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(
            f"{path}: cannot be written ({reason}); give a path in a writable directory"
        ) from None


class PostponedErrors:
    """Errors of writers, of which each is called although one before it has failed."""

    def __init__(self) -> None:
        self._first: OutputError | None = None

    @contextmanager
    def postponed(self) -> Iterator[None]:
        """Keep an OutputError for raise_first()."""
        try:
            yield
        except OutputError as error:
            self._first = self._first or error

    def raise_first(self) -> None:
        """Raise the first of the errors, if there was one."""
        if self._first is not None:
            raise self._first


def _publish(temporary: Path, path: Path) -> None:
    """Give a finished file its name; a link, unlike a rename, refuses an existing one."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        if os.path.lexists(path):
            raise FileExistsError from None
        os.rename(temporary, path)


def _exists(path: Path) -> OutputError:
    return OutputError(f"{path}: already exists and is not overwritten; give another path")
