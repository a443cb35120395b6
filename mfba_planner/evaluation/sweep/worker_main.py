# SPDX-License-Identifier: Apache-2.0
"""Main program of a worker process; started by worker.py, controlled through a pipe."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from ...core.child_process import end_with_parent
from . import sweep_chunks as _chunks  # noqa: F401  # imported now, so that its time does not count as work

MANY = 50_000  # new objects before garbage collection: runs are large and have no cycles


def main(descriptor: int) -> None:
    """Work on requests until the pipe is closed."""
    gc.set_threshold(MANY)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent
    end_with_parent(int(os.environ["MFBA_PARENT"]))
    # The parent closes the pipe to end this process.
    with Connection(descriptor) as pipe, suppress(EOFError, OSError):
        pipe.send(True)
        while True:
            _work(pipe, *pipe.recv())


def _work(
    pipe: Connection, work: Callable[[Any, Any], Any], items: tuple[Any, ...], shared: Any
) -> None:
    for item in items:
        try:
            result = work(item, shared)
        except Exception as error:
            pipe.send(error)
            return
        pipe.send(result)


if __name__ == "__main__":
    main(int(sys.argv[1]))
