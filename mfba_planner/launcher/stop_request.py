# SPDX-License-Identifier: Apache-2.0
"""Stop requests (signals, timeout), checked between ticks, so that a tick ends whole."""

from __future__ import annotations

import signal
import time
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StoppedError(Exception):
    """The run was stopped from outside: exit_code is 128 + signal, or 1 for the timeout."""

    def __init__(self, reason: str, exit_code: int) -> None:
        """Keep the reason and the exit code."""
        super().__init__(reason)
        self.exit_code = exit_code


class StopRequest:
    """A context manager that catches Ctrl-C, SIGTERM and SIGHUP, and holds the timeout."""

    def __init__(self, timeout_s: float) -> None:
        """Start the time limit, s of wall time."""
        self._timeout_s = timeout_s
        self._deadline = time.monotonic() + timeout_s
        self._received: list[int] = []
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in _SIGNALS:
            self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, _: FrameType | None) -> None:
        self._received.append(number)

    def check(self) -> None:
        """Raise StoppedError after a signal or the timeout."""
        if self._received:
            name = signal.Signals(self._received[0]).name
            raise StoppedError(f"interrupted by {name}", 128 + self._received[0])
        if time.monotonic() > self._deadline:
            raise StoppedError(
                f"timeout of {self._timeout_s:g} s reached; raise --timeout or look at the log", 1
            )

    def is_urgent(self) -> bool:
        """Whether a second signal has come."""
        return len(self._received) > 1
