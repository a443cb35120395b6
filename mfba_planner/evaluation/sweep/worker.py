# SPDX-License-Identifier: Apache-2.0
"""Work in a child process: an item that hangs or dies costs itself, not the sweep."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Pipe
from typing import Any, NamedTuple, TypeVar

from ...core.errors import MfbaError

START_S = 120.0  # a busy machine may take its time to start a process
# With other numbers of threads, sums are added up in another order: other last bits.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_LOCAL = threading.local()  # each thread has a child of its own

T = TypeVar("T")
Work = Callable[[Any, Any], T]  # of an item and what all items share; module level


class Lost(NamedTuple):
    """What stands for the result of an item whose process hung or died."""

    why: str


def each(
    work: Work[T], items: Sequence[Any], shared: Any, patience_s: float
) -> Iterator[T | Lost]:
    """Yield work(item, shared) of each item, all of it done in a child process.

    An error inside is raised here as it was there; an item that takes longer than patience_s, or
    ends its process, is Lost.
    """
    left = list(items)
    while left:
        for answer in _keeper().ask(work, tuple(left), shared, patience_s):
            del left[0]
            yield answer


def _keeper() -> Worker:
    found: Worker | None = getattr(_LOCAL, "keeper", None)
    # A planner of the user's own may be found by a path that was added since.
    if found is None or not found.is_alive or found.paths != sys.path:
        found = _LOCAL.keeper = Worker()
    return found


class Worker:
    """One child and the pipe to it."""

    def __init__(self) -> None:
        """Start the child. Raises MfbaError when it does not start."""
        self._pipe, theirs = Pipe()
        self.paths = list(sys.path)
        paths = os.pathsep.join(path for path in self.paths if path)
        told = {"PYTHONPATH": paths, "MFBA_PARENT": str(os.getpid()), **_ONE_THREAD}
        with theirs:
            self._child = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.worker_main", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # planners may print what they like
                env={**os.environ, **told},
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

    def ask(
        self, work: Work[T], items: tuple[Any, ...], shared: Any, patience_s: float
    ) -> Iterator[T | Lost]:
        """Yield the result of each item; Lost, and no more, where the child hung or died.

        Whoever stops listening before the end gets another child the next time.
        """
        finished = False
        try:
            self._pipe.send((work, items, shared))
            for number, _ in enumerate(items, 1):
                answer = self._heard(patience_s)
                if isinstance(answer, Exception):
                    raise answer
                # Now: who has as many answers as items does not ask for the end.
                finished = number == len(items) and not isinstance(answer, Lost)
                yield answer
                if isinstance(answer, Lost):
                    return
        finally:
            if not finished:
                self.end()

    def _heard(self, timeout_s: float) -> Any:
        """What the child says next; Lost for nothing in time, or never again."""
        try:
            if self._pipe.poll(timeout_s):
                return self._pipe.recv()
        except (EOFError, OSError):
            return Lost(f"its process died ({self._code()})")
        return Lost(f"hung: no end after {timeout_s:g} s of wall time")

    def _code(self) -> str:
        """How the child ended, whose end of the pipe is closed already."""
        try:
            code = self._child.wait(timeout=START_S)
        except subprocess.TimeoutExpired:
            return "it is still there"
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def end(self) -> None:
        """Kill the child."""
        with suppress(OSError):
            self._pipe.close()
        self._child.kill()
        self._child.wait()

    def __del__(self) -> None:
        if hasattr(self, "_child"):
            self.end()
