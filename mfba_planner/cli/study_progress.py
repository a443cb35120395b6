# SPDX-License-Identifier: Apache-2.0
"""A study at the command line: its arguments, and a progress bar where somebody watches."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import ConfigError
from ..evaluation.study.chunk import Chunk
from ..evaluation.study.chunk_store import Store
from ..evaluation.study.compute_chunks import check_workers
from ..paper.study.chunk import SampleChunk
from ..paper.study.run import Sample, run_plan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, workers, first seed, output."""
    parser.add_argument("--quick", action="store_true", help="few runs: seconds, wide intervals")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="first seed of every sample (default: 0)"
    )
    add_work_arguments(parser)


def add_work_arguments(parser: argparse.ArgumentParser) -> None:
    """Workers and output."""
    parser.add_argument(
        "--workers", type=int, default=_cores(), metavar="N",
        help="processes (default: one per core); the results do not depend on it",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory to create, or to go on in (default: a new one below runs/)",
    )  # fmt: skip


def check(found: argparse.Namespace) -> None:
    """Raise ConfigError for numbers that cannot be."""
    if not 0 <= found.seed < 2**62:
        raise ConfigError(f"--seed={found.seed}: out of range; give a whole number from 0 up")
    check_workers(found.workers)


def run_watched(chunks: Sequence[SampleChunk], workers: int, store: Store) -> dict[str, Sample]:
    """Run the plan under a progress bar."""
    with progress(chunks, store.directory) as done:
        return run_plan(chunks, workers=workers, store=store, done=done, say=say)


def say(line: str) -> None:
    """A word to whoever watches."""
    print(line, file=sys.stderr, flush=True)


@contextmanager
def progress(chunks: Sequence[Chunk], directory: Path) -> Iterator[Callable[[Chunk], None]]:
    """A progress bar, where somebody watches; tells how to go on after an interrupt."""
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
        say(f"interrupted; go on with --out {directory}")
        raise


def _cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not everywhere
        return os.cpu_count() or 1
