# SPDX-License-Identifier: Apache-2.0
"""Helper of sweep, tables and sensitivity, not a command: arguments and progress bar."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from ...core.option_specs import require_range
from ...evaluation.study.chunk import Chunk
from ...evaluation.study.chunk_store import Store
from ...evaluation.study.compute_chunks import check_workers
from ...evaluation.sweep.run_sweep import dask_executor
from ...paper.study.chunk import SampleChunk
from ...paper.study.run import Sample, run_plan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --quick, --seed, --workers and --out."""
    parser.add_argument(
        "--quick", action="store_true", help="few runs: takes seconds, gives wide intervals"
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="first seed of every sample (default: 0)"
    )
    add_work_arguments(parser)


def add_work_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --workers and --out."""
    parser.add_argument(
        "--workers", type=int, default=_available_cores(), metavar="N",
        help="processes (default: one per core); the results do not depend on it",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory to create, or to continue in (default: a new one below runs/)",
    )  # fmt: skip


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --scheduler, for executor_at(), and those of add_work_arguments()."""
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="tcp://HOST:PORT of a dask.distributed scheduler"
    )
    add_work_arguments(parser)


def check(parsed: argparse.Namespace) -> None:
    """Raise ConfigError for a seed or a number of workers out of range."""
    require_range("--seed", parsed.seed, 0, 2**62 - 1)
    check_workers(parsed.workers)


def run_with_progress(
    chunks: Sequence[SampleChunk], workers: int, store: Store
) -> dict[str, Sample]:
    """Run the plan with a progress bar."""
    with progress(chunks, store.directory) as done:
        return run_plan(chunks, workers=workers, store=store, done=done, warn=print_status)


def print_status(line: str) -> None:
    """Print a line on stderr."""
    print(line, file=sys.stderr, flush=True)


@contextmanager
def progress(chunks: Sequence[Chunk], directory: Path) -> Iterator[Callable[[Chunk], None]]:
    """A progress bar on a terminal; after an interrupt it prints how to continue."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    try:
        with Progress(
            *columns, console=console, transient=True, disable=not console.is_terminal
        ) as bar:
            task = bar.add_task("running", total=sum(chunk.cost for chunk in chunks))
            yield lambda chunk: bar.advance(task, chunk.cost)
    except (KeyboardInterrupt, SystemExit):
        print_status(f"interrupted; continue with --out {directory}")
        raise


@contextmanager
def executor_at(scheduler: str | None) -> Iterator[Executor | None]:
    """The workers of a dask.distributed scheduler; None without an address."""
    if scheduler is None:
        yield None
        return
    with dask_executor(scheduler) as executor:
        yield executor


def _available_cores() -> int:
    """Number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1
