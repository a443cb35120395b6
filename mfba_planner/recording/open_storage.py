# SPDX-License-Identifier: Apache-2.0
"""Open a storage file by its first bytes: MCAP, sqlite3, ROS 1, each also zstd-compressed."""

from __future__ import annotations

from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import zstandard

from ..core.errors import BagError
from ..core.input_files import open_input
from .mcap_index import GIVE_BAG, open_file
from .storage_file import StorageFile

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
SQLITE_MAGIC, ROS1_MAGIC = b"SQLite format 3\0", b"#ROSBAG V"
_COPY_BYTES = 1 << 20


def open_storage(path: Path, stack: ExitStack, *, salvage: bool) -> StorageFile:
    """Open a file; `stack` closes it. Raises BagError, also where the reader is not installed.

    A file that is compressed as a whole is decompressed into a temporary directory first.
    """
    head, source = _head(path), path
    is_compressed = head.startswith(ZSTD_MAGIC)
    if is_compressed:
        folder = stack.enter_context(TemporaryDirectory(prefix="mfba-"))
        source = _decompress(path, Path(folder), salvage=salvage)
        head = _head(source)
    file: StorageFile
    if head.startswith((SQLITE_MAGIC, ROS1_MAGIC)):
        is_sqlite = head.startswith(SQLITE_MAGIC)
        _require_rosbags(path, "a sqlite3 (.db3) bag" if is_sqlite else "a ROS 1 bag")
        module = "sqlite_file" if is_sqlite else "ros1_file"
        file = import_module(f"{__package__}.{module}").open_file(source, path, salvage=salvage)
    else:
        file = open_file(source, salvage=salvage, shown=path)
    stack.callback(file.close)
    if is_compressed:
        file.kind += ", zstd per file"
    return file


def _head(path: Path) -> bytes:
    try:
        with open_input(path) as stream:
            return stream.read(16)
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}); {GIVE_BAG}") from error


def _require_rosbags(path: Path, kind: str) -> None:
    try:
        import_module("rosbags.rosbag2")
    except ImportError:
        raise BagError(
            f"{path}: {kind}, but rosbags is not installed; pip install 'mfba_planner[bags]'"
        ) from None


def _decompress(path: Path, folder: Path, *, salvage: bool) -> Path:
    """The decompressed file; with `salvage` as much of it as there is."""
    target = folder / path.stem
    try:
        with open_input(path) as compressed, target.open("wb") as plain:
            reader = zstandard.ZstdDecompressor().stream_reader(compressed)
            while block := reader.read(_COPY_BYTES):
                plain.write(block)
    except zstandard.ZstdError as error:
        if not salvage or not target.stat().st_size:
            raise BagError(
                f"{path}: damaged, cannot be decompressed ({error}); run `mfba recover {path}`"
            ) from error
    except OSError as error:
        raise BagError(
            f"{path}: cannot be decompressed below {folder.parent} ({error.strerror}); "
            "set TMPDIR to a directory with more room"
        ) from error
    return target
