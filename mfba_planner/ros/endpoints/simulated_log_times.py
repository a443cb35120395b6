# SPDX-License-Identifier: Apache-2.0
"""Log times in simulated time: when a message was sent, however late it is received."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Iterator
from typing import NamedTuple

from ..interface.serialized_message import clock_ns
from ..runtime.polled_subscriptions import SerializedMessage

KEPT = 20_000  # values of /clock; a reader keeps 5000 messages of a topic
HELD_LIMIT = 5000  # messages


class Timed(NamedTuple):
    """A message to write: its topic, bytes and log time (ns)."""

    name: str
    data: bytes
    log_time_ns: int


class _Held(NamedTuple):
    name: str
    message: SerializedMessage
    stamp_ns: int


class SimulatedLogTimes:
    """Gives every message the value of /clock at the time at which it was sent.

    What is lost in transit comes later, by many ticks, and so does all that follows on its
    topic; the time of reception would put it behind younger messages. Messages that come before
    their /clock are held until it comes.
    """

    def __init__(self) -> None:
        """Start before the first /clock."""
        self._sent_ns: list[int] = []
        self._clock_ns: list[int] = []
        self._held: list[_Held] = []

    def add_clock(self, name: str, message: SerializedMessage) -> Iterator[Timed]:
        """Take a message of /clock; yield what can be written now."""
        now_ns = clock_ns(message.data)
        if self._sent_ns and message.sent_ns < self._sent_ns[-1]:  # the wall clock was set back
            self._sent_ns, self._clock_ns = [], []
        self._sent_ns.append(message.sent_ns)
        self._clock_ns.append(now_ns)
        if len(self._sent_ns) >= 2 * KEPT:
            del self._sent_ns[:KEPT], self._clock_ns[:KEPT]
        held, self._held = self._held, []
        for other in held:
            yield from self.add(*other)
        yield Timed(name, message.data, now_ns)

    def add(self, name: str, message: SerializedMessage, stamp_ns: int = 0) -> Iterator[Timed]:
        """Take another message; yield it, unless it is held.

        stamp_ns: the tick's, 0 for a message without it.
        """
        if self._held or not self._clock_ns or stamp_ns > self._clock_ns[-1]:
            self._held.append(_Held(name, message, stamp_ns))  # what is sent later stays behind
            if len(self._held) > HELD_LIMIT:
                yield from self.take_held()
        else:
            yield Timed(name, message.data, self._log_time_ns(message.sent_ns, stamp_ns))

    def take_held(self) -> Iterator[Timed]:
        """Yield what waits for a /clock that does not come."""
        held, self._held = self._held, []
        for name, message, stamp_ns in held:
            known = bool(self._clock_ns)
            time_ns = self._log_time_ns(message.sent_ns, stamp_ns) if known else time.time_ns()
            yield Timed(name, message.data, time_ns)

    def _log_time_ns(self, sent_ns: int, stamp_ns: int) -> int:
        index = max(bisect_right(self._sent_ns, sent_ns) - 1, 0)  # latched before: the first
        # The rest of a tick may be published after the next /clock, but before the one after it.
        if index and stamp_ns == self._clock_ns[index - 1]:
            index -= 1
        return self._clock_ns[index]
