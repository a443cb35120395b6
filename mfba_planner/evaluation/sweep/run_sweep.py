# SPDX-License-Identifier: Apache-2.0
"""A whole sweep: parts, store, executor, table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError, MfbaError
from ...core.options import flatten
from ..study.chunk import Chunk
from ..study.chunk_store import Store
from ..study.compute_chunks import compute
from .chunks import chunks_of
from .columns import Row
from .sweep_spec import SweepSpec
from .table import build, sorted_hash

COMMAND = "mfba sweep"
PACKAGES = ("core", "oracle", "planners", "sweep", "worlds")  # their code decides the numbers
CONNECT_S = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Swept:
    """What came of a sweep."""

    order: SweepSpec
    rows: list[Row]
    timings: list[Row]

    @property
    def hash(self) -> str:
        """Sorted hash of the table."""
        return sorted_hash(self.rows)


def spec_facts(order: SweepSpec) -> dict[str, Any]:
    """What the directory of a sweep says of it."""
    return {
        "suite": order.suite,
        "planners": list(order.planners),
        "first": order.first,
        "worlds": order.worlds,
        "seeds": order.seeds,
        "oracle": order.oracle,
        "setting": order.setting.facts(),
        "own": {name: flatten(params) for name, params in order.own.items()},
    }


def open_store(directory: Path, order: SweepSpec) -> Store:
    """The directory of a sweep, new or to go on in. Raises OutputError as Store does."""
    chunks = chunks_of(order)
    return Store(directory, chunks, spec_facts(order), command=COMMAND, packages=PACKAGES)


def sweep(
    order: SweepSpec,
    *,
    workers: int = 1,
    executor: Executor | None = None,
    store: Store | None = None,
    done: Callable[[Chunk], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> Swept:
    """Make all runs (or read them back); the result does not depend on who makes them.

    workers, executor, store, done and say as in study.compute, which tells what is raised.
    """
    chunks = chunks_of(order)
    found = compute(chunks, workers=workers, executor=executor, store=store, done=done, say=say)
    rows, timings = build(order, chunks, found)
    return Swept(order=order, rows=rows, timings=timings)


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """The workers of a dask.distributed scheduler, as an executor.

    Raises ConfigError where distributed is missing, MfbaError where nobody answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ConfigError(
            f"--scheduler {address}: distributed is not installed; "
            "pip install 'mfba_planner[dask]', or leave it out"
        ) from None
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        reason = " ".join(str(error).split())[:120]
        raise MfbaError(
            f"--scheduler {address}: cannot be reached ({reason}); give tcp://HOST:PORT of one "
            "that runs"
        ) from None
    with client:
        yield client.get_executor(pure=False)
