# SPDX-License-Identifier: Apache-2.0
"""The directory of one run, created before the start, so that no two runs share one."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import OutputError
from ..core.output_files import RESULT, PostponedErrors, new_run_directory
from ..recording.atomic_files import make_directory, remove_empty

_MAX_TRIES = 100  # so many launchers may start at once


class RunDirectory:
    """A directory that this process has created, and the paths of its files."""

    def __init__(self, wanted: Path | None) -> None:
        """Create wanted, or the next free directory below ./runs.

        Raises OutputError where it exists (another launcher may use it) or cannot be created.
        """
        self.path, self._made = _claim(wanted)
        self.bag = self.path / "bag"
        self.result = self.path / RESULT
        self.picture = self.path / "run.png"
        self.log = self.path / "log.txt"

    def discard(self) -> None:
        """Remove the directory and its files, for a run that has not started."""
        shutil.rmtree(self.path, ignore_errors=True)
        remove_empty(self._made)

    @contextmanager
    def discarded_on_error(self) -> Iterator[None]:
        """Discard the directory if the body fails: a retry may give the same name."""
        try:
            yield
        except BaseException:
            self.discard()
            raise

    def complete(self, writers: Iterable[Callable[[], object]], show: Callable[[], None]) -> None:
        """Write the results of a run, show them and print what the directory holds.

        A writer that fails stops none of these; its OutputError is raised at the end. A directory
        that holds nothing is removed.
        """
        errors = PostponedErrors()
        for write in writers:
            with errors.postponed():
                write()
        show()
        if names := self.contents():
            print(f"wrote {self.path}: {', '.join(names)}", flush=True)
        else:
            self.discard()
        errors.raise_first()

    def contents(self) -> list[str]:
        """Names of the files in it, sorted."""
        return sorted(os.listdir(self.path))


def _claim(wanted: Path | None) -> tuple[Path, list[Path]]:
    for run in range(_MAX_TRIES):
        path = wanted if wanted is not None else new_run_directory()
        try:
            return path, make_directory(path)
        except OutputError as error:
            # Another launcher has created the same name, or a parent, in the meantime.
            is_taken = isinstance(error.__cause__, FileExistsError)
            cannot_retry = wanted is not None and os.path.lexists(path)
            if not is_taken or cannot_retry or run == _MAX_TRIES - 1:
                raise
    raise AssertionError("unreachable")
