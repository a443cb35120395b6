# SPDX-License-Identifier: Apache-2.0
"""Compute chunks on any concurrent.futures executor; by default on local processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import TypeVar

from ...core.errors import ConfigError, MfbaError
from ...core.interrupts import interrupts_held
from .chunk import Chunk, Columns
from .chunk_store import Store

MAX_WORKERS = 256
TRIES = 3  # of a chunk whose worker dies

P = TypeVar("P", bound=Chunk)
Done = Callable[[P], None]


class WorkerDied(Exception):  # noqa: N818
    """The process that computed a chunk died; the chunk may be computed again."""


def check_workers(workers: int) -> None:
    """Raise ConfigError for a number of workers out of range."""
    if not 1 <= workers <= MAX_WORKERS:
        raise ConfigError(f"--workers={workers}: out of range; give 1 to {MAX_WORKERS}")


def compute(
    chunks: Sequence[P],
    *,
    workers: int = 1,
    executor: Executor | None = None,
    store: Store | None = None,
    done: Done[P] = lambda _: None,
    warn: Callable[[str], None] = lambda _: None,
) -> dict[str, Columns]:
    """Compute (or read from the store) every chunk: {name of the chunk: its columns}.

    done is called with each finished chunk, in any sequence; warn with a message when a worker
    died. An early end leaves the finished chunks in the store. A given executor is left open,
    and workers is ignored. Raises ConfigError for workers out of range, MfbaError for a chunk
    whose worker died TRIES times.
    """
    check_workers(workers)
    found: dict[str, Columns] = {}
    missing = []
    for chunk in chunks:
        columns = store.read(chunk) if store else None
        if columns is None:
            missing.append(chunk)
        else:
            found[chunk.name] = columns
            done(chunk)
    for chunk, columns in _computed(missing, workers, executor, warn):
        if store:
            store.write(chunk, columns)
        found[chunk.name] = columns
        done(chunk)
    return found


def _computed(
    chunks: Sequence[P], workers: int, executor: Executor | None, warn: Callable[[str], None]
) -> Iterator[tuple[P, Columns]]:
    if executor is None and (workers == 1 or len(chunks) < 2):
        yield from ((chunk, chunk.run()) for chunk in chunks)
        return
    died: Counter[str] = Counter()
    remaining = {chunk.name: chunk for chunk in chunks}
    while remaining:
        suspects = [chunk for chunk in remaining.values() if died[chunk.name]]
        # Chunks that ran when a worker died are tried again one by one, to find the cause.
        batch = suspects[:1] or list(remaining.values())
        for chunk, outcome in _batch(batch, workers, executor):
            if isinstance(outcome, WorkerDied):
                died[chunk.name] += 1
                _report(chunk, died[chunk.name], single=len(batch) == 1, warn=warn)
            else:
                del remaining[chunk.name]
                yield chunk, outcome


def _report(chunk: Chunk, times: int, *, single: bool, warn: Callable[[str], None]) -> None:
    if single and times >= TRIES:
        raise MfbaError(
            f"{chunk.name}: a worker process died {times} times on it (out of memory?); run again "
            "with fewer --workers; finished chunks are kept"
        )
    warn(f"{chunk.name}: its worker process may have died; running it again alone")


def _batch(
    chunks: Sequence[P], workers: int, executor: Executor | None
) -> Iterator[tuple[P, Columns | WorkerDied]]:
    """Ends early after a worker died: chunks that were not started have no result."""
    if executor is not None:
        yield from _gathered(chunks, executor, len(chunks))
        return
    # Spawned, not forked: the parent may have threads; and the same on every platform.
    workers = min(workers, len(chunks))
    own = ProcessPoolExecutor(
        workers,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=initialize_worker,
    )
    try:
        yield from _gathered(chunks, own, workers + 1)
    except BaseException:
        # A worker interrupted by Ctrl-C while starting may hang; its results are not needed.
        for child in multiprocessing.active_children():
            child.kill()
        raise
    finally:
        own.shutdown(wait=True, cancel_futures=True)


def _gathered(
    chunks: Sequence[P], executor: Executor, at_once: int
) -> Iterator[tuple[P, Columns | WorkerDied]]:
    """Submit at_once chunks, and one more for each that finishes."""
    waiting = iter(chunks)
    running: dict[Future[Columns], P] = {}
    died = False
    try:
        running.update((executor.submit(chunk.run), chunk) for chunk in islice(waiting, at_once))
        while running:
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            outcomes = [(running.pop(future), _outcome(future)) for future in finished]
            died = died or any(isinstance(outcome, WorkerDied) for _, outcome in outcomes)
            if not died:
                more = islice(waiting, len(finished))
                running.update((executor.submit(chunk.run), chunk) for chunk in more)
            yield from outcomes
    finally:
        for future in running:
            future.cancel()


def _outcome(future: Future[Columns]) -> Columns | WorkerDied:
    try:
        return future.result()
    except BrokenProcessPool:
        return WorkerDied()
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # dask's; imported only where it is used
            return WorkerDied()
        raise


def initialize_worker() -> None:
    """Worker set-up: ignore Ctrl-C, which the parent handles; exit when the parent dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interrupts_held():
        threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    """Exit when the parent does: idle workers of a killed parent would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
