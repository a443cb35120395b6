# SPDX-License-Identifier: Apache-2.0
"""Find the .mcap files of a bag: a bare file, or a directory with metadata.yaml."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import BagError
from . import bag_metadata as metadata
from .bag_metadata import BagMetadata


@dataclass
class BagFiles:
    """The storage files in sequence, the metadata.yaml (None without one), problems found."""

    files: list[Path]
    metadata: BagMetadata | None = None
    problems: list[str] = field(default_factory=list)


def find_bag_files(path: Path, *, salvage: bool) -> BagFiles:
    """Find a bag's files; `salvage` allows a missing or broken metadata.yaml. Raises BagError."""
    try:
        if path.is_file():
            return BagFiles([path])
        if not path.exists():
            raise BagError(f"{path}: does not exist; give a .mcap file or a bag directory")
        if not path.is_dir():
            raise BagError(f"{path}: not a file; give a .mcap file or a bag directory")
        found = sorted(path.glob("*.mcap"), key=_natural_key)
        metadata_path = path / metadata.FILE_NAME
        if not metadata_path.exists():
            return _without_metadata(path, found, salvage)
        try:
            return _with_metadata(metadata_path)
        except BagError as error:
            if not salvage or not found:
                raise
            return BagFiles(found, problems=[str(error).split("; ")[0]])
    except OSError as error:
        raise BagError(
            f"{path}: cannot be read ({error.strerror}); give a .mcap file or a bag directory"
        ) from error


def _without_metadata(path: Path, found: list[Path], salvage: bool) -> BagFiles:
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
    return BagFiles(found, problems=[f"{missing}: the recording was not closed"])


def _with_metadata(metadata_path: Path) -> BagFiles:
    try:
        text = metadata_path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise BagError(f"{metadata_path}: not UTF-8 text; give the .mcap file itself") from error
    content = metadata.load_file(text, str(metadata_path))
    return BagFiles([_storage_file(metadata_path, file.path) for file in content.files], content)


def _storage_file(metadata_path: Path, name: str) -> Path:
    # Before version 4 each path started with the bag directory.
    for candidate in (metadata_path.parent / name, metadata_path.parent / Path(name).name):
        if candidate.is_file():
            return candidate
    raise BagError(
        f"{metadata_path}: lists {name}, which does not exist; "
        "restore that file, or give a .mcap file"
    )


def _natural_key(path: Path) -> list[tuple[int, str]]:
    """Sort key that puts bag_2 before bag_10."""
    return [(int(p), "") if p.isdigit() else (0, p) for p in re.split(r"(\d+)", path.name)]
