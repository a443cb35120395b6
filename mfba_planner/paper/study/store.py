# SPDX-License-Identifier: Apache-2.0
"""Chunks of results on disk: written whole, checked when read, of one plan and one version."""

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
from ...outputs import write_new
from .chunk import Chunk, Columns

SCHEMA_VERSION = 1
MANIFEST = "study.json"
_ANOTHER = "give another --out"


class Store:
    """A directory of finished chunks that an interrupted study goes on from."""

    def __init__(self, directory: Path, plan: Sequence[Chunk], facts: Mapping[str, Any]) -> None:
        """Open or make it; OutputError when it is of another version, plan or kind."""
        self.directory = directory
        self._chunks = directory / "chunks"
        wanted = manifest(plan, facts)
        try:
            if directory.is_dir() and any(directory.iterdir()):
                _compare(directory, wanted)
            else:
                self._chunks.mkdir(parents=True)
                write_new(directory / MANIFEST, _text(wanted))
            self._chunks.mkdir(exist_ok=True)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise OutputError(
                f"{directory}: cannot be written ({reason}); give a writable --out"
            ) from None

    def read(self, chunk: Chunk) -> Columns | None:
        """A finished chunk; None when it is not there or not whole, and so to be computed."""
        try:
            data = json.loads((self._chunks / f"{chunk.name}.json").read_text(encoding="utf-8"))
            columns: Columns = data["columns"]
            whole = data["sha256"] == digest(columns)
        except (OSError, ValueError, TypeError, KeyError):
            return None
        return columns if whole else None

    def write(self, chunk: Chunk, columns: Columns) -> None:
        """Keep a finished chunk; what stood in its place was not whole."""
        path = self._chunks / f"{chunk.name}.json"
        path.unlink(missing_ok=True)
        write_new(path, _text({"columns": columns, "sha256": digest(columns)}))


def manifest(plan: Sequence[Chunk], facts: Mapping[str, Any]) -> dict[str, Any]:
    """All that decides the numbers: versions, the code itself, what is run with what."""
    works = {chunk.sample: chunk.work.facts() for chunk in plan}
    return {
        "schema_version": SCHEMA_VERSION,
        "mfba_planner": __version__,
        "code": code_digest(),
        "numpy": np.__version__,
        **facts,
        "chunks": [chunk.name for chunk in plan],
        "samples": digest(works),
    }


def _compare(directory: Path, wanted: Mapping[str, Any]) -> None:
    try:
        found = json.loads((directory / MANIFEST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise OutputError(
            f"{directory}: not empty and no results of `mfba tables` ({MANIFEST} is missing); "
            f"{_ANOTHER}"
        ) from None
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise OutputError(f"{directory}: {MANIFEST} is cut short or not JSON; {_ANOTHER}")
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
def code_digest() -> str:
    """SHA-256 over the sources that the numbers come from: core and paper."""
    package = Path(__file__).parents[2]
    sources = sorted([*package.glob("core/*.py"), *package.glob("paper/*.py")])
    sources += sorted(package.glob("paper/study/*.py"))
    found = hashlib.sha256()
    for path in sources:
        found.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def _text(data: Any) -> bytes:
    return f"{json.dumps(data, indent=None)}\n".encode()
