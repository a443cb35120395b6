# SPDX-License-Identifier: Apache-2.0
"""The directory of one run: claimed before anything starts, so that no two runs share one."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from ..core.errors import OutputError
from ..core.outputs import new_run_directory
from ..recording.file_storage import make_directory, remove_empty

_ATTEMPTS = 100  # as many launchers may start at once


class RunDirectory:
    """A directory that this process has made."""

    def __init__(self, wanted: Path | None) -> None:
        """Make wanted, or the next free directory below ./runs.

        Raises OutputError where it exists (another launcher may be using it) or cannot be made.
        """
        self.path, self._made = _claim(wanted)
        self.bag = self.path / "bag"
        self.result = self.path / "result.json"
        self.picture = self.path / "run.png"
        self.log = self.path / "log.txt"

    def discard(self) -> None:
        """Remove the directory and what is in it, for a run that never began."""
        shutil.rmtree(self.path, ignore_errors=True)
        remove_empty(self._made)

    def contents(self) -> list[str]:
        """Names of what was left in it, sorted."""
        return sorted(os.listdir(self.path))


def _claim(wanted: Path | None) -> tuple[Path, list[Path]]:
    for run in range(_ATTEMPTS):
        path = wanted if wanted is not None else new_run_directory()
        try:
            return path, make_directory(path)
        except OutputError as error:
            # Another launcher was quicker: with the same new name, or with a parent.
            overtaken = isinstance(error.__cause__, FileExistsError)
            lost = wanted is not None and os.path.lexists(path)
            if not overtaken or lost or run == _ATTEMPTS - 1:
                raise
    raise AssertionError("unreachable")
