# SPDX-License-Identifier: Apache-2.0
"""Paths of the shipped files (config/, launch/, layout/), installed or in a checkout."""

from functools import cache
from pathlib import Path

from mfba_planner.core.errors import InputError


@cache
def share_dir() -> Path:
    """Return the folder that holds config/; InputError when the installation lacks it.

    It is the nearest one above this package: PREFIX/share/mfba_planner after pip or colcon, the
    checkout in a source tree, an editable install or a symlink install.
    """
    file = Path(__file__).absolute()
    for above in (*file.parents, *file.resolve().parents):
        for candidate in (above / "share" / "mfba_planner", above):
            if (candidate / "package.xml").is_file() and (candidate / "config").is_dir():
                return candidate
    raise InputError(
        f"{file.parent}: no share/mfba_planner above it, so no config/; "
        "install with pip or colcon, or run from a checkout"
    )


def config_path(name: str) -> Path:
    """Return a file below config/, such as 'planner.yaml'; InputError when it is missing."""
    path = share_dir() / "config" / name
    if not path.is_file():
        raise InputError(f"{name}: not a shipped file; see {path.parent}")
    return path


def scenario_path(name: str) -> Path:
    """Return the file of a shipped scenario, such as 'case1'; InputError for any other name."""
    return config_path(f"scenarios/{name}.yaml")


def scenario_names() -> list[str]:
    """Return the names of the shipped scenarios, sorted."""
    return sorted(path.stem for path in (share_dir() / "config/scenarios").glob("*.yaml"))
