# SPDX-License-Identifier: Apache-2.0
"""Worker: a child process for work that may hang or crash without stopping the sweep."""

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

START_S = 120.0  # time limit to start a process, for busy machines
# The number of threads changes the sequence of sums and so their last bits.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_LOCAL = threading.local()  # each thread has a child of its own

T = TypeVar("T")
Work = Callable[[Any, Any], T]  # of an item and the shared argument; a module-level function


class Lost(NamedTuple):
    """The result of an item whose process hung or died."""

    why: str


def run_in_worker(
    work: Work[T], items: Sequence[Any], shared: Any, patience_s: float
) -> Iterator[T | Lost]:
    """Yield work(item, shared) of each item, computed in a child process.

    An exception in the child is raised here; an item that takes longer than patience_s, or ends
    its process, is Lost.
    """
    remaining = list(items)
    while remaining:
        for result in _thread_worker().run(work, tuple(remaining), shared, patience_s):
            del remaining[0]
            yield result


def _thread_worker() -> Worker:
    found: Worker | None = getattr(_LOCAL, "worker", None)
    # A user's planner may be on a path that was added since.
    if found is None or not found.is_alive or found.paths != sys.path:
        found = _LOCAL.worker = Worker()
    return found


class Worker:
    """A child process and the pipe to it."""

    def __init__(self) -> None:
        """Start the child. Raises MfbaError when it does not start."""
        self._pipe, theirs = Pipe()
        self.paths = list(sys.path)
        paths = os.pathsep.join(path for path in self.paths if path)
        variables = {"PYTHONPATH": paths, "MFBA_PARENT": str(os.getpid()), **_ONE_THREAD}
        with theirs:
            self._child = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.worker_main", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # planners may print what they like
                env={**os.environ, **variables},
            )
        if self._receive(START_S) is not True:
            self.end()
            raise MfbaError(
                f"{sys.executable}: a worker process did not start; see its output above"
            )

    @property
    def is_alive(self) -> bool:
        """Whether the child can take work."""
        return self._child.poll() is None and not self._pipe.closed

    def run(
        self, work: Work[T], items: tuple[Any, ...], shared: Any, patience_s: float
    ) -> Iterator[T | Lost]:
        """Yield the result of each item; ends after Lost, when the child hung or died.

        A caller that stops before the end gets a new child the next time.
        """
        finished = False
        try:
            self._pipe.send((work, items, shared))
            for number, _ in enumerate(items, 1):
                result = self._receive(patience_s)
                if isinstance(result, Exception):
                    raise result
                # Set before the yield: the caller does not exhaust the generator.
                finished = number == len(items) and not isinstance(result, Lost)
                yield result
                if isinstance(result, Lost):
                    return
        finally:
            if not finished:
                self.end()

    def _receive(self, timeout_s: float) -> Any:
        """The next message of the child; Lost after the timeout or when the child died."""
        try:
            if self._pipe.poll(timeout_s):
                return self._pipe.recv()
        except (EOFError, OSError):
            return Lost(f"its process died ({self._code()})")
        return Lost(f"hung: no end after {timeout_s:g} s of wall time")

    def _code(self) -> str:
        """Exit code or signal of a child whose pipe is closed."""
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
