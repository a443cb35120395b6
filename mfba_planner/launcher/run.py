# SPDX-License-Identifier: Apache-2.0
"""One attempt at a run: what was ordered, where it goes, how far and how fast it is."""

from __future__ import annotations

import time

from ..simulation.fleet import Fleet
from ..simulation.world import World
from .console import RunConsole
from .run_arguments import RunRequest
from .run_directory import RunDirectory
from .stop_request import StoppedError, StopRequest


class Run:
    """What the three drivers are given."""

    def __init__(
        self, request: RunRequest, directory: RunDirectory, console: RunConsole, stop: StopRequest
    ) -> None:
        """Nothing has happened yet."""
        self.request = request
        self.directory = directory
        self.console = console
        self.stop = stop
        self.stopped: StoppedError | None = None
        self.wall_s: float | None = None  # of the loop, without starting and ending
        self._began_at: float | None = None
        self._shown = (0.0, 0)

    @property
    def has_begun(self) -> bool:
        """Whether the world was let go; before that there is nothing worth keeping."""
        return self._began_at is not None

    def begin(self) -> None:
        """The world is let go; again changes nothing."""
        if self._began_at is None:
            self._began_at = time.monotonic()
            self._shown = (self._began_at, 0)

    def end(self) -> None:
        """The world has come to its end."""
        if self._began_at is not None:
            self.wall_s = time.monotonic() - self._began_at

    def go_on(self, world: World | Fleet) -> bool:
        """For drivers that let the world be seen: show it, and say whether to go on."""
        self.begin()
        try:
            self.stop.check()
        except StoppedError as stopped:
            self.stopped = stopped
            return False
        if self.console.wants_progress():
            self.show(world.tick, world.distance_to_goal_m)
        return True

    def show(self, tick: int, distance_m: float, mode: str = "") -> None:
        """Show how far the run is."""
        now, (then, before) = time.monotonic(), self._shown
        self._shown = (now, tick)
        parts = [
            f"tick {tick}",
            f"{distance_m:.2f} m to the goal",
            mode.replace("_", " "),
            f"{(tick - before) / (now - then):.0f} ticks/s" if now > then else "",
        ]
        self.console.progress(", ".join(part for part in parts if part))
