# SPDX-License-Identifier: Apache-2.0
"""The state of one run, for all drivers: request, directory, console, progress, stop."""

from __future__ import annotations

import time
from contextlib import suppress
from importlib import import_module
from threading import Thread

from ..simulation.fleet import Fleet
from ..simulation.world import World
from .console import RunConsole
from .run_arguments import RunRequest
from .run_directory import RunDirectory
from .stop_request import StoppedError, StopRequest


class Run:
    """One run; each of the three drivers gets one."""

    def __init__(
        self, request: RunRequest, directory: RunDirectory, console: RunConsole, stop: StopRequest
    ) -> None:
        """Keep the arguments; the run has not started."""
        self.request = request
        self.directory = directory
        self.console = console
        self.stop = stop
        self.stopped: StoppedError | None = None
        self.wall_s: float | None = None  # of the loop only, without start-up and shutdown
        self._started_at: float | None = None
        self._shown = (0.0, 0)

    @property
    def has_started(self) -> bool:
        """Whether the world has started; before that there is nothing to keep."""
        return self._started_at is not None

    def start(self) -> None:
        """Note that the world has started; a second call has no effect."""
        if self._started_at is None:
            self._started_at = time.monotonic()
            self._shown = (self._started_at, 0)

    def end(self) -> None:
        """Note that the run has ended."""
        if self._started_at is not None:
            self.wall_s = time.monotonic() - self._started_at

    def prepare_results(self) -> None:
        """Import what draws the picture in a thread, while the caller waits for other processes.

        An import that fails does so again, and is reported, where the picture is drawn.
        """
        if self.request.picture:
            name = "fleet_figure" if self.request.config.scenario.robots else "run_figure"
            Thread(target=_try_import, args=(f"mfba_planner.report.{name}",), daemon=True).start()

    def should_continue(self, world: World | Fleet) -> bool:
        """Show the progress; return whether the run continues. For drivers in this process."""
        self.start()
        try:
            self.stop.check()
        except StoppedError as stopped:
            self.stopped = stopped
            return False
        if self.console.is_progress_due():
            self.show(world.tick, world.distance_to_goal_m)
        return True

    def show(self, tick: int, distance_m: float, mode: str = "") -> None:
        """Print the progress: tick, distance to the goal, mode, ticks per second."""
        now, (then, before) = time.monotonic(), self._shown
        self._shown = (now, tick)
        fields = [
            f"tick {tick}",
            f"{distance_m:.2f} m to the goal",
            mode.replace("_", " "),
            f"{(tick - before) / (now - then):.0f} ticks/s" if now > then else "",
        ]
        self.console.show_progress(", ".join(field for field in fields if field))


def _try_import(name: str) -> None:
    with suppress(Exception):
        import_module(name)
