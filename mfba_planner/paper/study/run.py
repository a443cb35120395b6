# SPDX-License-Identifier: Apache-2.0
"""Run a plan's chunks on any number of workers; the samples do not depend on how many."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

import numpy as np
from numpy.typing import NDArray

from ...core.errors import ConfigError, MfbaError
from .chunk import Chunk, Columns
from .store import Store

MAX_WORKERS = 256
Sample = Mapping[str, NDArray[np.float64]]


def run_plan(
    plan: Sequence[Chunk],
    *,
    workers: int = 1,
    store: Store | None = None,
    done: Callable[[Chunk], None] = lambda _: None,
) -> dict[str, Sample]:
    """Compute (or read back) every chunk; {sample: {column: values by seed}}.

    done hears of each chunk, in no certain order. Whatever ends this early leaves the chunks
    that were finished in the store. Raises ConfigError for a number of workers that cannot be.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise ConfigError(f"--workers={workers}: out of range; give 1 to {MAX_WORKERS}")
    found: dict[str, Columns] = {}
    missing = []
    for chunk in plan:
        columns = store.read(chunk) if store else None
        if columns is None:
            missing.append(chunk)
        else:
            found[chunk.name] = columns
            done(chunk)
    for chunk, columns in _compute(missing, workers):
        if store:
            store.write(chunk, columns)
        found[chunk.name] = columns
        done(chunk)
    return _samples(plan, found)


def _samples(plan: Sequence[Chunk], found: Mapping[str, Columns]) -> dict[str, Sample]:
    gathered: dict[str, Columns] = {}
    for chunk in plan:
        sample = gathered.setdefault(chunk.sample, {})
        for column, values in found[chunk.name].items():
            sample.setdefault(column, []).extend(values)
    return {
        name: {column: np.array(values, dtype=float) for column, values in sample.items()}
        for name, sample in gathered.items()
    }


def _compute(plan: Sequence[Chunk], workers: int) -> Iterator[tuple[Chunk, Columns]]:
    if workers == 1 or len(plan) < 2:
        yield from ((chunk, chunk.run()) for chunk in plan)
        return
    # Spawned, not forked: the parent may have threads, and every platform does the same.
    executor = ProcessPoolExecutor(
        min(workers, len(plan)),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_belong_to_the_parent,
    )
    try:
        running = {executor.submit(chunk.run): chunk for chunk in plan}
        for future in as_completed(running):
            yield running[future], future.result()
    except BrokenProcessPool:
        raise MfbaError(
            "a worker process died (out of memory?); run again with fewer --workers, "
            "finished parts are kept"
        ) from None
    except BaseException:
        # A worker that a Ctrl-C met while it started may never end; what it does is not needed.
        for child in multiprocessing.active_children():
            child.kill()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _belong_to_the_parent() -> None:
    """Leave Ctrl-C, which reaches all processes of a terminal, to the parent; end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    """Idle workers of a parent that was killed would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
