# SPDX-License-Identifier: Apache-2.0
"""The distance to go is computed by a library that takes SIGINT: it must not end the process."""

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

from mfba_planner.core.interrupts import _OwnProgram, interrupts_held, start_own_program
from mfba_planner.planning.eikonal import march

# Nearly all of the time of this program is the library's.
MARCHING = """
from mfba_planner.core.interrupts import start_own_program
start_own_program()
import numpy as np
from mfba_planner.planning.eikonal import march
speed = np.ones((40, 40))
march(speed, (0, 0), 0.05)
for _ in range(200):
    try:
        print("ready", flush=True)
        while True:
            march(speed, (0, 0), 0.05)
    except KeyboardInterrupt:
        pass
print("interrupted 200 times")
"""


def test_it_is_the_distance_where_nothing_stands() -> None:
    to_go = march(np.ones((30, 40)), (0, 0), 0.1)
    rows, columns = np.indices(to_go.shape)
    assert to_go == pytest.approx(0.1 * np.hypot(rows, columns), abs=0.04)


def test_interrupts_while_it_is_computed_come_after_it() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", MARCHING],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"},
        text=True,
    ) as program:
        assert program.stdout is not None
        time_limit = threading.Timer(
            60.0, program.kill
        )  # what such a handler breaks may also hang
        time_limit.start()
        while program.stdout.readline() == "ready\n":
            program.send_signal(signal.SIGINT)
        _, stderr = program.communicate()
        time_limit.cancel()
    assert (program.returncode, stderr) == (0, "")


def held() -> bool:
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_interrupts_are_held_only_within_the_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_OwnProgram, "started", True)
    with interrupts_held():
        assert held()
        with interrupts_held():
            pass
        assert held()
    assert not held()


def test_other_programs_have_threads_that_would_take_them() -> None:
    with interrupts_held():
        assert not held()


@pytest.mark.parametrize(("threads", "own"), [(None, True), ("1", True), ("4", False)])
def test_our_programs_have_no_threads_of_numpy(
    monkeypatch: pytest.MonkeyPatch, threads: str | None, own: bool
) -> None:
    monkeypatch.setattr(_OwnProgram, "started", False)
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if threads:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", threads)
    start_own_program()
    assert _OwnProgram.started == own
    assert os.environ["OPENBLAS_NUM_THREADS"] == (threads or "1")
