# SPDX-License-Identifier: Apache-2.0
"""A study at the command line: its arguments, and a progress bar where somebody watches."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from .core.errors import ConfigError
from .paper.study.chunk import Chunk
from .paper.study.run import MAX_WORKERS, Sample, run_plan
from .paper.study.store import Store


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, workers, first seed, output."""
    parser.add_argument("--quick", action="store_true", help="few runs: seconds, wide intervals")
    parser.add_argument(
        "--workers", type=int, default=_cores(), metavar="N",
        help="processes (default: one per core); the results do not depend on it",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="first seed of every sample (default: 0)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory to create, or to go on in (default: a new one below runs/)",
    )  # fmt: skip


def check(found: argparse.Namespace) -> None:
    """Raise ConfigError for numbers that cannot be."""
    if not 0 <= found.seed < 2**62:
        raise ConfigError(f"--seed={found.seed}: out of range; give a whole number from 0 up")
    if not 1 <= found.workers <= MAX_WORKERS:
        raise ConfigError(f"--workers={found.workers}: out of range; give 1 to {MAX_WORKERS}")


def run_watched(chunks: Sequence[Chunk], workers: int, store: Store) -> dict[str, Sample]:
    """Run the plan under a progress bar, where somebody watches; tell how to go on later."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    try:
        with Progress(
            *columns, console=console, transient=True, disable=not console.is_terminal
        ) as progress:
            task = progress.add_task("running", total=sum(chunk.cost for chunk in chunks))
            return run_plan(
                chunks,
                workers=workers,
                store=store,
                done=lambda chunk: progress.advance(task, chunk.cost),
            )
    except (KeyboardInterrupt, SystemExit):
        print(f"interrupted; go on with --out {store.directory}", file=sys.stderr)
        raise


def _cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not everywhere
        return os.cpu_count() or 1
