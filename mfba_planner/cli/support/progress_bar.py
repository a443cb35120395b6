# SPDX-License-Identifier: Apache-2.0
"""Helper of commands, not a command: a progress bar for work that takes longer than 2 s."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

from ...simulation.fleet import Fleet
from ...simulation.world import World

QUIET_S = 2.0  # no progress bar before

Show = Callable[[float, float], None]


@contextmanager
def progress_bar(what: str) -> Iterator[Show]:
    """Yield show(done, total): from QUIET_S on, on a terminal, a bar with the time left.

    Nothing is to be printed meanwhile. rich is imported when the bar appears.
    """
    started_s, bars = monotonic(), list[Any]()

    def show(done: float, total: float) -> None:
        if monotonic() - started_s > QUIET_S:
            if not bars:
                bars.append(_started_bar(what))
            bars[0].update(bars[0].task_ids[0], completed=done, total=total)

    try:
        yield show
    finally:
        for bar in bars:
            bar.stop()


def _started_bar(what: str) -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    bar.start()
    bar.add_task(what)
    return bar


@contextmanager
def simulation_progress() -> Iterator[Callable[[World | Fleet], bool]]:
    """Yield go_on for a simulation: it shows what part of the way to the goal is covered."""
    first_m = list[float]()
    with progress_bar("simulating") as show:

        def go_on(world: World | Fleet) -> bool:
            left_m = world.distance_to_goal_m
            if not first_m:
                first_m.append(left_m)
            show(max(0.0, first_m[0] - left_m), first_m[0])
            return True

        yield go_on
