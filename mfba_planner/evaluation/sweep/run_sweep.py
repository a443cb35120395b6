# SPDX-License-Identifier: Apache-2.0
"""Run a sweep: chunks, store, executor, table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError, MfbaError
from ...core.option_specs import flatten
from ..study.chunk import Chunk
from ..study.chunk_store import Store
from ..study.compute_chunks import compute
from .sweep_chunks import chunks_of
from .sweep_spec import SweepSpec
from .table import build, sorted_hash
from .table_columns import Row

COMMAND = "mfba sweep"
# The folders whose code determines the results.
PACKAGES = (
    "core", "evaluation", "optimizers", "perception", "planning", "scenarios", "simulation",
    "swarm",
)  # fmt: skip
CONNECT_S = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepResult:
    """The result of a sweep: rows and timings."""

    spec: SweepSpec
    rows: list[Row]
    timings: list[Row]

    @property
    def hash(self) -> str:
        """Hash of the table, independent of the sequence of rows."""
        return sorted_hash(self.rows)


def spec_facts(spec: SweepSpec) -> dict[str, Any]:
    """The specification as plain data, for the manifest."""
    setting, scenarios = spec.setting.facts(), spec.setting.scenarios
    setting.pop("scenarios", None)
    return {
        **({} if scenarios is None else {"scenarios": scenarios.facts()}),
        "suite": spec.suite,
        "planners": list(spec.planners),
        "first": spec.first,
        "worlds": spec.worlds,
        "seeds": spec.seeds,
        "oracle": spec.oracle,
        "setting": setting,
        "own": {name: flatten(params) for name, params in spec.own.items()},
    }


def open_store(directory: Path, spec: SweepSpec) -> Store:
    """The store of a sweep, new or resumed. Raises OutputError as Store does."""
    chunks = chunks_of(spec)
    return Store(directory, chunks, spec_facts(spec), command=COMMAND, packages=PACKAGES)


def sweep(
    spec: SweepSpec,
    *,
    workers: int = 1,
    executor: Executor | None = None,
    store: Store | None = None,
    done: Callable[[Chunk], None] = lambda _: None,
    warn: Callable[[str], None] = lambda _: None,
) -> SweepResult:
    """Compute all runs (or read them from the store); the same result on any executor.

    workers, executor, store, done, warn and errors as in study.compute_chunks.compute.
    """
    chunks = chunks_of(spec)
    found = compute(chunks, workers=workers, executor=executor, store=store, done=done, warn=warn)
    rows, timings = build(spec, chunks, found)
    return SweepResult(spec=spec, rows=rows, timings=timings)


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """The workers of a dask.distributed scheduler, as an executor.

    Raises ConfigError where distributed is missing, MfbaError where no scheduler replies.
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
            f"--scheduler {address}: cannot be reached ({reason}); give tcp://HOST:PORT of a "
            "running scheduler"
        ) from None
    with client:
        yield client.get_executor(pure=False)
