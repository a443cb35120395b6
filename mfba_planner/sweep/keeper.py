# SPDX-License-Identifier: Apache-2.0
"""Runs in a child process: one that hangs or dies costs its run, not the sweep."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Pipe
from typing import Any

from ..core.errors import MfbaError
from .columns import Row, lost_row
from .order import Run, Setting

START_S = 120.0  # a busy machine may take its time to start a process
_LOCAL = threading.local()  # each thread has a child of its own


def rows(runs: Sequence[Run], setting: Setting) -> Iterator[tuple[Row, Row]]:
    """Make runs, one after the other, and yield (row, timing) of each."""
    left = list(runs)
    while left:
        keeper = _keeper()
        for answer in keeper.ask(tuple(left), setting):
            run = left.pop(0)
            if isinstance(answer, str):  # why the child is gone
                yield lost_row(run, answer), {}
            else:
                yield answer


def _keeper() -> Keeper:
    found: Keeper | None = getattr(_LOCAL, "keeper", None)
    if found is None or not found.is_alive:
        found = _LOCAL.keeper = Keeper()
    return found


class Keeper:
    """One child and the pipe to it."""

    def __init__(self) -> None:
        """Start the child. Raises MfbaError when it does not start."""
        self._pipe, theirs = Pipe()
        paths = os.pathsep.join(path for path in sys.path if path)
        with theirs:
            self._child = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.child", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # planners may print what they like
                env={**os.environ, "PYTHONPATH": paths, "MFBA_PARENT": str(os.getpid())},
            )
        if self._heard(START_S) is not True:
            self.end()
            raise MfbaError(
                f"{sys.executable}: a process for runs did not start; see what it said above"
            )

    @property
    def is_alive(self) -> bool:
        """Whether it can be asked."""
        return self._child.poll() is None and not self._pipe.closed

    def ask(self, runs: tuple[Run, ...], setting: Setting) -> Iterator[Any]:
        """Yield (row, timing) of each run; a text, and no more, where the child hung or died.

        An error that is not the planner's is raised here as it was there. Whoever stops
        listening before the end gets another child the next time.
        """
        finished = False
        try:
            self._pipe.send((runs, setting))
            for _ in runs:
                answer = self._heard(setting.patience_s)
                if isinstance(answer, Exception):
                    raise answer
                if answer is None:
                    yield self._last_words(setting)
                    return
                yield answer
            finished = True
        finally:
            if not finished:
                self.end()

    def _heard(self, timeout_s: float) -> Any:
        """What the child says next, None for nothing in time or never again."""
        try:
            return self._pipe.recv() if self._pipe.poll(timeout_s) else None
        except (EOFError, OSError):
            return None

    def _last_words(self, setting: Setting) -> str:
        try:
            # A child that died has closed its end of the pipe, and is gone in no time.
            code = self._child.wait(timeout=0.5)
        except subprocess.TimeoutExpired:
            return f"hung: no end after {setting.patience_s:g} s of wall time"
        reason = f"signal {-code}" if code < 0 else f"exit code {code}"
        return f"its process died ({reason})"

    def end(self) -> None:
        """Kill the child."""
        with suppress(OSError):
            self._pipe.close()
        self._child.kill()
        self._child.wait()

    def __del__(self) -> None:
        if hasattr(self, "_child"):
            self.end()
