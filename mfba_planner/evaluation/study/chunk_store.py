# SPDX-License-Identifier: Apache-2.0
"""Finished chunks of a study on disk: written atomically, checked when read, of one version."""

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
from ...core.input_files import read_input_text
from ...core.output_files import write_new
from .chunk import Chunk, Columns

SCHEMA_VERSION = 1
MANIFEST, CHUNKS = "study.json", "chunks"
_ANOTHER = "give another --out"
# Said of facts that are too long to show.
_CHANGED = {
    "code": "the code has changed since",
    "scenarios": "the scenario files have changed since",
}


class Store:
    """A directory of finished chunks, from which an interrupted study is resumed."""

    def __init__(
        self,
        directory: Path,
        chunks: Sequence[Chunk],
        facts: Mapping[str, Any],
        *,
        command: str,
        packages: Sequence[str],
    ) -> None:
        """Open or create it. Raises OutputError for results of another version, study or command.

        command is named in messages; packages are the folders whose code determines the results.
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
        """The columns of a chunk; None when missing or damaged."""
        return read_chunk(self.directory, chunk.name)

    def write(self, chunk: Chunk, columns: Columns) -> None:
        """Write a finished chunk; replaces a damaged file."""
        path = self.directory / CHUNKS / f"{chunk.name}.json"
        path.unlink(missing_ok=True)
        write_new(path, _text({"columns": columns, "sha256": digest(columns)}))


def read_chunk(directory: Path, name: str) -> Columns | None:
    """The columns of the chunk of that name; None when missing or damaged."""
    try:
        data = json.loads(read_input_text(directory / CHUNKS / f"{name}.json"))
        columns: Columns = data["columns"]
        whole = data["sha256"] == digest(columns)
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return columns if whole else None


def manifest(
    chunks: Sequence[Chunk], facts: Mapping[str, Any], packages: Sequence[str]
) -> dict[str, Any]:
    """All that determines the results: versions, code digest, facts, chunks."""
    return {
        "schema_version": SCHEMA_VERSION,
        "mfba_planner": __version__,
        "code": code_digest(*packages),
        "numpy": np.__version__,
        **facts,
        "chunks": [chunk.name for chunk in chunks],
        "samples": digest([chunk.facts() for chunk in chunks]),
    }


def read_manifest(directory: Path, command: str, remedy: str = _ANOTHER) -> dict[str, Any]:
    """Read the manifest of a directory of results. Raises OutputError, with the remedy."""
    try:
        found = json.loads(read_input_text(directory / MANIFEST))
    except (FileNotFoundError, NotADirectoryError):
        state = "not empty and " if remedy == _ANOTHER else ""
        raise OutputError(
            f"{directory}: {state}no results of `{command}` ({MANIFEST} is missing); {remedy}"
        ) from None
    except OSError as error:
        raise OutputError(
            f"{directory}: {MANIFEST} cannot be read ({(error.strerror or str(error)).lower()}); "
            f"{remedy}"
        ) from None
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise OutputError(f"{directory}: {MANIFEST} is cut short or not JSON; {remedy}")
    return found


def _compare(directory: Path, wanted: Mapping[str, Any], command: str) -> None:
    found = read_manifest(directory, command)
    for name, value in wanted.items():
        if found.get(name) != value:
            shown = f"{name}={found.get(name)!r}, now {value!r}"
            if name in ("chunks", "samples", *_CHANGED):
                shown = _CHANGED.get(name, "what is run differs")
            raise OutputError(
                f"{directory}: results of another version or configuration ({shown}); {_ANOTHER}"
            )


def digest(data: Any) -> str:
    """SHA-256 of plain data."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


@cache
def code_digest(*packages: str) -> str:
    """SHA-256 over the sources in some folders of mfba_planner, recursively."""
    root = Path(__file__).parents[2]
    found = hashlib.sha256()
    for path in sorted(path for name in packages for path in (root / name).rglob("*.py")):
        found.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def _text(data: Any) -> bytes:
    return f"{json.dumps(data, indent=None)}\n".encode()
