# SPDX-License-Identifier: Apache-2.0
"""The process that runs are made in; started by keeper.py, spoken to through a pipe."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from multiprocessing.connection import Connection
from time import perf_counter

from ..leash import end_with_parent
from .columns import made_row, timing_row
from .order import Run, Setting
from .play import play


def main(descriptor: int) -> None:
    """Make the runs asked for until the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is the parent's matter
    end_with_parent(int(os.environ["MFBA_PARENT"]))
    # Whoever has heard enough closes the pipe.
    with Connection(descriptor) as pipe, suppress(EOFError, OSError):
        pipe.send(True)
        while True:
            _answer(pipe, *pipe.recv())


def _answer(pipe: Connection, runs: tuple[Run, ...], setting: Setting) -> None:
    for run in runs:
        begun = perf_counter()
        try:
            played = play(run, setting)
        except Exception as error:  # ours, not the planner's
            pipe.send(error)
            return
        wall_ms = 1e3 * (perf_counter() - begun)
        pipe.send((made_row(run, played), timing_row(played.times_ns, wall_ms)))


if __name__ == "__main__":
    main(int(sys.argv[1]))
