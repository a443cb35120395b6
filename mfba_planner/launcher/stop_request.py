# SPDX-License-Identifier: Apache-2.0
"""Signals as a question that is asked between two steps, so that nothing is torn apart."""

from __future__ import annotations

import signal
import time
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StoppedError(Exception):
    """The run was ended from outside: exit_code says by which signal, 1 is the timeout."""

    def __init__(self, reason: str, exit_code: int) -> None:
        """Keep the reason, in words, and the exit code."""
        super().__init__(reason)
        self.exit_code = exit_code


class StopRequest:
    """Ctrl-C, SIGTERM, SIGHUP or the end of the time, while this context lasts."""

    def __init__(self, timeout_s: float) -> None:
        """Start the clock."""
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
        """Raise StoppedError when the run is to end."""
        if self._received:
            name = signal.Signals(self._received[0]).name
            raise StoppedError(f"interrupted by {name}", 128 + self._received[0])
        if time.monotonic() > self._deadline:
            raise StoppedError(
                f"timeout of {self._timeout_s:g} s reached; raise --timeout or look at the log", 1
            )

    def is_urgent(self) -> bool:
        """Whether the user has asked twice."""
        return len(self._received) > 1
