# SPDX-License-Identifier: Apache-2.0
"""SIGINT held back while it would find a handler that is not ours.

The kernel gives a signal to any thread that does not hold it, to the main thread first. So the
main thread may hold it for a moment only if no other thread takes it: in our own programs.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

_BLAS_THREADS = "OPENBLAS_NUM_THREADS"


class _OwnProgram:
    """Whether this process is one of our programs, all of whose other threads hold SIGINT."""

    started = False


def start_own_program() -> None:
    """Say, before numpy is imported, that all threads will be started under interrupts_held()."""
    # Our matrices are small: starting numpy's thread pool would cost 0.06 s per start.
    os.environ.setdefault(_BLAS_THREADS, "1")
    _OwnProgram.started = os.environ[_BLAS_THREADS] == "1"


@contextmanager
def interrupts_held() -> Iterator[None]:
    """SIGINT waits for the end of the block; threads that are started in it never take it.

    Nothing is held in other people's programs, whose threads may take it.
    """
    if not _OwnProgram.started:
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
