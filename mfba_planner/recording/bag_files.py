# SPDX-License-Identifier: Apache-2.0
"""Which .mcap files a path stands for: a bare file, or a bag directory with metadata.yaml."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import BagError
from . import bag_metadata as metadata
from .bag_metadata import BagMetadata


@dataclass
class Located:
    """The storage files in order, metadata.yaml if there is one, and what is wrong so far."""

    files: list[Path]
    metadata: BagMetadata | None = None
    problems: list[str] = field(default_factory=list)


def locate(path: Path, *, salvage: bool) -> Located:
    """Find a bag's files; `salvage` does without a sound metadata.yaml. Raises BagError."""
    try:
        if path.is_file():
            return Located([path])
        if not path.exists():
            raise BagError(f"{path}: does not exist; give a .mcap file or a bag directory")
        if not path.is_dir():
            raise BagError(f"{path}: not a file; give a .mcap file or a bag directory")
        found = sorted(path.glob("*.mcap"), key=_natural)
        listed = path / metadata.FILE_NAME
        if not listed.exists():
            return _unlisted(path, found, salvage)
        try:
            return _listed(listed)
        except BagError as error:
            if not salvage or not found:
                raise
            return Located(found, problems=[str(error).split("; ")[0]])
    except OSError as error:
        raise BagError(
            f"{path}: cannot be read ({error.strerror}); give a .mcap file or a bag directory"
        ) from error


def _unlisted(path: Path, found: list[Path], salvage: bool) -> Located:
    missing = f"{metadata.FILE_NAME} is missing"
    if not found:
        kind = "a sqlite3 (.db3) bag" if any(path.glob("*.db3")) else "not a bag"
        raise BagError(
            f"{path}: {kind}, {missing} and so is any .mcap file; "
            "give a .mcap file or a bag directory"
        )
    if not salvage:
        raise BagError(
            f"{path}: {missing} (the recording was not closed); run `mfba recover {path}`"
        )
    return Located(found, problems=[f"{missing}: the recording was not closed"])


def _listed(listed: Path) -> Located:
    try:
        text = listed.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise BagError(f"{listed}: not UTF-8 text; give the .mcap file itself") from error
    content = metadata.load_file(text, str(listed))
    return Located([_file(listed, file.path) for file in content.files], content)


def _file(listed: Path, name: str) -> Path:
    # Before version 4 the bag's own directory led each path.
    for candidate in (listed.parent / name, listed.parent / Path(name).name):
        if candidate.is_file():
            return candidate
    raise BagError(
        f"{listed}: names {name}, which is not there; put the file back, or give a .mcap file"
    )


def _natural(path: Path) -> list[tuple[int, str]]:
    """bag_2 before bag_10."""
    return [(int(p), "") if p.isdigit() else (0, p) for p in re.split(r"(\d+)", path.name)]
