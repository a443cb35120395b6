# SPDX-License-Identifier: Apache-2.0
"""Chunks on any executor: workers that die, and the chunks kept after an early end."""

import multiprocessing
import os
import re
import signal
from collections.abc import Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from mfba_planner.core.errors import ConfigError, MfbaError
from mfba_planner.core.interrupts import start_own_program
from mfba_planner.evaluation.study.chunk_store import Store
from mfba_planner.evaluation.study.compute_chunks import TRIES, compute, initialize_worker


@dataclass(frozen=True)
class Square:
    """A chunk that computes a square; first it kills its worker as often as a file says."""

    number: int
    deaths: Path | None = None

    @property
    def name(self) -> str:
        return f"square-{self.number}"

    @property
    def cost(self) -> float:
        return 1.0

    def facts(self) -> Mapping[str, Any]:
        return {"number": self.number}

    def run(self) -> dict[str, list[int]]:
        if self.deaths is not None:
            left = int(self.deaths.read_text())
            self.deaths.write_text(str(left - 1))
            if left > 0:
                os._exit(3)
        return {"square": [self.number**2]}


def squares(found: Mapping[str, Any]) -> dict[str, int]:
    return {name: columns["square"][0] for name, columns in found.items()}


EXPECTED = {f"square-{k}": k * k for k in range(7)}


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_any_number_of_workers(workers: int) -> None:
    finished: list[str] = []
    found = compute(
        [Square(k) for k in range(7)],
        workers=workers,
        done=lambda chunk: finished.append(chunk.name),
    )
    assert squares(found) == EXPECTED
    assert sorted(finished) == sorted(EXPECTED)


def test_any_executor_which_is_left_open() -> None:
    with ThreadPoolExecutor(2) as executor:
        assert squares(compute([Square(k) for k in range(7)], executor=executor)) == EXPECTED
        assert executor.submit(int, "3").result() == 3


def test_a_chunk_whose_worker_dies_is_named_and_run_again(tmp_path: Path) -> None:
    deaths = tmp_path / "deaths"
    deaths.write_text("2")
    messages: list[str] = []
    chunks = [Square(k, deaths if k == 3 else None) for k in range(7)]
    assert squares(compute(chunks, workers=2, warn=messages.append)) == EXPECTED
    assert "square-3: its worker process may have died; running it again alone" in messages
    assert deaths.read_text() == "-1"


def test_a_chunk_that_kills_every_worker_raises_and_the_rest_is_kept(tmp_path: Path) -> None:
    deaths = tmp_path / "deaths"
    deaths.write_text("1000")
    chunks = [Square(k, deaths if k == 3 else None) for k in range(7)]
    store = Store(tmp_path / "out", chunks, {}, command="x", packages=("core",))
    with pytest.raises(MfbaError, match=r"square-3: a worker process died 3 times on it"):
        compute(chunks, workers=2, store=store)
    assert int(deaths.read_text()) == 1000 - TRIES
    kept = [chunk.name for chunk in chunks if store.read(chunk)]
    assert "square-3" not in kept
    deaths.write_text("0")
    again: list[str] = []
    found = compute(chunks, workers=2, store=store, done=lambda chunk: again.append(chunk.name))
    assert squares(found) == EXPECTED


class Unlucky(Executor):
    """A cluster that loses the worker of its first chunk."""

    def __init__(self, error: Exception) -> None:
        self.error: Exception | None = error

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        if self.error:
            future.set_exception(self.error)
            self.error = None
        else:
            future.set_result(fn(*args, **kwargs))
        return future


class KilledWorker(Exception):  # noqa: N818
    """Has the name of dask's exception."""


@pytest.mark.parametrize("error", [BrokenProcessPool(), KilledWorker()])
def test_a_cluster_that_loses_a_worker(error: Exception) -> None:
    messages: list[str] = []
    chunks = [Square(k) for k in range(7)]
    assert squares(compute(chunks, executor=Unlucky(error), warn=messages.append)) == EXPECTED
    assert len(messages) == 1


def test_an_exception_of_a_chunk_is_raised_unchanged() -> None:
    with pytest.raises(ZeroDivisionError):
        compute([Square(1)], executor=Unlucky(ZeroDivisionError()))


def test_numbers_of_workers_out_of_range() -> None:
    with pytest.raises(ConfigError, match=r"--workers=0: out of range; give 1 to 256"):
        compute([], workers=0)


def _threads_that_take_an_interrupt() -> list[bool]:
    """In a worker: for each of its threads whether it is the main one, if SIGINT may reach it."""
    found = []
    for task in Path("/proc/self/task").iterdir():
        held = re.search(r"^SigBlk:\s*(\w+)", (task / "status").read_text(), re.MULTILINE)
        assert held
        if not int(held[1], 16) >> (signal.SIGINT - 1) & 1:
            found.append(task.name == str(os.getpid()))
    return found


def test_only_the_main_thread_of_a_worker_takes_an_interrupt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Another one would get it while the main thread computes the distance to go."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, context, initializer=_start_worker) as executor:
        assert executor.submit(_threads_that_take_an_interrupt).result() == [True]


def _start_worker() -> None:
    start_own_program()
    initialize_worker()
