# SPDX-License-Identifier: Apache-2.0
"""Finished parts on disk: written whole, checked when read, of one study and one version."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...core.errors import OutputError
from ...core.outputs import write_new
from .chunk import Chunk, Columns

SCHEMA_VERSION = 1
MANIFEST, CHUNKS = "study.json", "chunks"
_ANOTHER = "give another --out"


class Store:
    """A directory of finished parts that an interrupted study goes on from."""

    def __init__(
        self,
        directory: Path,
        chunks: Sequence[Chunk],
        facts: Mapping[str, Any],
        *,
        command: str,
        packages: Sequence[str],
    ) -> None:
        """Open or make it; OutputError when it is of another version, study or kind.

        command names the study to users; packages are the folders whose code decides the numbers.
        """
        self.directory = directory
        folder = directory / CHUNKS
        wanted = manifest(chunks, facts, packages)
        try:
            if directory.is_dir() and any(directory.iterdir()):
                _compare(directory, wanted, command)
            else:
                folder.mkdir(parents=True)
                write_new(directory / MANIFEST, _text(wanted))
            folder.mkdir(exist_ok=True)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise OutputError(
                f"{directory}: cannot be written ({reason}); give a writable --out"
            ) from None

    def read(self, chunk: Chunk) -> Columns | None:
        """A finished part; None when it is not there or not whole, and so to be computed."""
        return read_chunk(self.directory, chunk.name)

    def write(self, chunk: Chunk, columns: Columns) -> None:
        """Keep a finished part; what stood in its place was not whole."""
        path = self.directory / CHUNKS / f"{chunk.name}.json"
        path.unlink(missing_ok=True)
        write_new(path, _text({"columns": columns, "sha256": digest(columns)}))


def read_chunk(directory: Path, name: str) -> Columns | None:
    """The finished part of that name; None when it is not there or not whole."""
    try:
        data = json.loads((directory / CHUNKS / f"{name}.json").read_text(encoding="utf-8"))
        columns: Columns = data["columns"]
        whole = data["sha256"] == digest(columns)
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return columns if whole else None


def manifest(
    chunks: Sequence[Chunk], facts: Mapping[str, Any], packages: Sequence[str]
) -> dict[str, Any]:
    """All that decides the numbers: versions, the code itself, what is run with what."""
    return {
        "schema_version": SCHEMA_VERSION,
        "mfba_planner": __version__,
        "code": code_digest(*packages),
        "numpy": np.__version__,
        **facts,
        "chunks": [chunk.name for chunk in chunks],
        "samples": digest([chunk.facts() for chunk in chunks]),
    }


def read_manifest(directory: Path, command: str) -> dict[str, Any]:
    """What a directory of results says of itself. Raises OutputError."""
    try:
        found = json.loads((directory / MANIFEST).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise OutputError(
            f"{directory}: not empty and no results of `{command}` ({MANIFEST} is missing); "
            f"{_ANOTHER}"
        ) from None
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise OutputError(f"{directory}: {MANIFEST} is cut short or not JSON; {_ANOTHER}")
    return found


def _compare(directory: Path, wanted: Mapping[str, Any], command: str) -> None:
    found = read_manifest(directory, command)
    for name, value in wanted.items():
        if found.get(name) != value:
            shown = f"{name}={found.get(name)!r}, now {value!r}"
            if name in ("chunks", "samples", "code"):
                shown = {"code": "the code has changed since"}.get(name, "what is run differs")
            raise OutputError(
                f"{directory}: results of another version or configuration ({shown}); {_ANOTHER}"
            )


def digest(data: Any) -> str:
    """SHA-256 of plain data."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


@cache
def code_digest(*packages: str) -> str:
    """SHA-256 over the sources in some folders of this package, those inside them included."""
    root = Path(__file__).parents[1]
    found = hashlib.sha256()
    for path in sorted(path for name in packages for path in (root / name).rglob("*.py")):
        found.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def _text(data: Any) -> bytes:
    return f"{json.dumps(data, indent=None)}\n".encode()
