# SPDX-License-Identifier: Apache-2.0
"""Find the storage files of a bag: a bare file, or a directory, usually with metadata.yaml."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import BagError
from ..core.input_files import MOST_YAML_BYTES, read_input_text
from ..core.output_files import RESULT
from . import bag_metadata as metadata
from .bag_metadata import BagMetadata
from .mcap_index import GIVE_BAG

_SUFFIXES = (".mcap", ".db3", ".bag")  # each also with .zstd behind


@dataclass
class BagFiles:
    """The storage files in sequence, the metadata.yaml (None without one), problems found."""

    files: list[Path]
    metadata: BagMetadata | None = None
    problems: list[str] = field(default_factory=list)


def find_bag_files(path: Path, *, salvage: bool) -> BagFiles:
    """Find a bag's files. Raises BagError.

    Without metadata.yaml the files of the directory are taken, and that is a problem of the bag.
    `salvage` also allows a broken metadata.yaml.
    """
    try:
        if path.is_file():
            return BagFiles([path])
        if not path.exists():
            raise BagError(f"{path}: does not exist; {GIVE_BAG}")
        if not path.is_dir():
            raise BagError(f"{path}: not a file; {GIVE_BAG}")
        metadata_path = path / metadata.FILE_NAME
        if not metadata_path.exists():
            return _without_metadata(path)
        try:
            return _with_metadata(metadata_path)
        except BagError as error:
            found = _files_in(path)
            if not salvage or not found:
                raise
            return BagFiles(found, problems=[str(error).split("; ")[0]])
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}); {GIVE_BAG}") from error


def _files_in(path: Path) -> list[Path]:
    """The storage files of a directory, those of one format only. Raises BagError for several."""
    found = {
        suffix: sorted([*path.glob(f"*{suffix}"), *path.glob(f"*{suffix}.zstd")], key=_natural_key)
        for suffix in _SUFFIXES
    }
    kinds = [suffix for suffix, files in found.items() if files]
    if len(kinds) > 1 or len(found[".bag"]) > 1:
        names = ", ".join(file.name for kind in kinds for file in found[kind])
        raise BagError(f"{path}: holds several recordings, {names}; give one of these files")
    return found[kinds[0]] if kinds else []


def _without_metadata(path: Path) -> BagFiles:
    missing = f"{metadata.FILE_NAME} is missing"
    found = _files_in(path)
    if not found:
        if (path / RESULT).is_file():
            raise BagError(
                f"{path}: has no bag, only {RESULT}, as of a run without ROS; give a bag, or use "
                "digest, report, animate or view"
            )
        raise BagError(
            f"{path}: not a bag, {missing} and so is any .mcap, .db3 or .bag file; {GIVE_BAG}"
        )
    if found[0].suffix == ".bag":  # ROS 1 writes none
        return BagFiles(found)
    return BagFiles(found, problems=[f"{missing}: the recording was not closed"])


def _with_metadata(metadata_path: Path) -> BagFiles:
    try:
        text = read_input_text(metadata_path, MOST_YAML_BYTES)
    except UnicodeDecodeError as error:
        raise BagError(
            f"{metadata_path}: not UTF-8 text; give the .mcap or .db3 file itself"
        ) from error
    content = metadata.load_file(text, str(metadata_path))
    return BagFiles([_storage_file(metadata_path, file.path) for file in content.files], content)


def _storage_file(metadata_path: Path, name: str) -> Path:
    # Before version 4 each path started with the bag directory.
    for candidate in (metadata_path.parent / name, metadata_path.parent / Path(name).name):
        if candidate.is_file():
            return candidate
    raise BagError(
        f"{metadata_path}: lists {name}, which does not exist; "
        "restore that file, or give one of the others by itself"
    )


def _natural_key(path: Path) -> list[tuple[int, str]]:
    """Sort key that puts bag_2 before bag_10."""
    return [(int(p), "") if p.isdigit() else (0, p) for p in re.split(r"(\d+)", path.name)]
