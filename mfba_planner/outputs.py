# SPDX-License-Identifier: Apache-2.0
"""Where results go: a new directory each time; what is there is never overwritten."""

from __future__ import annotations

from pathlib import Path

from .core.errors import OutputError


def new_run_directory(root: Path = Path("runs")) -> Path:
    """Name (not make) a directory below root that is not there yet: run-001, run-002, ..."""
    taken = [int(p.name[4:]) for p in root.glob("run-*") if p.name[4:].isdigit()]
    return root / f"run-{max(taken, default=0) + 1:03d}"


def refuse_existing(path: Path) -> Path:
    """Return path, or raise OutputError if something is there."""
    if path.exists() or path.is_symlink():
        raise OutputError(f"{path}: exists and is never overwritten; choose another --out")
    return path


def bag_in(path: Path) -> Path:
    """The bag of a run directory; anything else is taken for a bag itself."""
    bag = path / "bag"
    return bag if bag.is_dir() and not any(path.glob("*.mcap")) else path
