# SPDX-License-Identifier: Apache-2.0
"""The process that work is done in; started by keeper.py, spoken to through a pipe."""

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
from . import chunks as _parts  # noqa: F401  # now: later it would be taken for slow work

MANY = 50_000  # new objects before the collector looks for cycles: runs are large and have none


def main(descriptor: int) -> None:
    """Do what is asked for until the pipe is closed."""
    gc.set_threshold(MANY)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is the parent's matter
    end_with_parent(int(os.environ["MFBA_PARENT"]))
    # Whoever has heard enough closes the pipe.
    with Connection(descriptor) as pipe, suppress(EOFError, OSError):
        pipe.send(True)
        while True:
            _answer(pipe, *pipe.recv())


def _answer(
    pipe: Connection, work: Callable[[Any, Any], Any], items: tuple[Any, ...], shared: Any
) -> None:
    for item in items:
        try:
            answer = work(item, shared)
        except Exception as error:
            pipe.send(error)
            return
        pipe.send(answer)


if __name__ == "__main__":
    main(int(sys.argv[1]))
