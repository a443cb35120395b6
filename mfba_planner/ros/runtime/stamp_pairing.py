# SPDX-License-Identifier: Apache-2.0
"""Two streams joined by stamp: each stamp answered once, nothing answered backwards."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, Generic, TypeVar

from ...core.errors import StampError

A = TypeVar("A")
B = TypeVar("B")

WAITING_LIMIT = 10_000  # messages of one stream that may wait for their partner


class StampPairs(Generic[A, B]):
    """Join stream a with stream b; a pair is given out as soon as both parts are there.

    With `again`, the last pair is given out once more when both its parts come once more.
    """

    def __init__(self, *, again: bool = False) -> None:
        """Start with nothing waiting."""
        self._again = again
        self._a: OrderedDict[int, A] = OrderedDict()
        self._b: OrderedDict[int, B] = OrderedDict()
        self._answered_ns = -1

    def add_a(self, stamp_ns: int, value: A) -> tuple[A, B] | None:
        """Take a message of stream a; StampError for a stamp that was answered before."""
        self._refuse_old(stamp_ns)
        if stamp_ns in self._b:
            pair = (value, self._b[stamp_ns])
            self._forget_up_to(stamp_ns)
            return pair
        _wait(stamp_ns, value, self._a)
        return None

    def add_b(self, stamp_ns: int, value: B) -> tuple[A, B] | None:
        """Take a message of stream b; StampError for a stamp that was answered before."""
        self._refuse_old(stamp_ns)
        if stamp_ns in self._a:
            pair = (self._a[stamp_ns], value)
            self._forget_up_to(stamp_ns)
            return pair
        _wait(stamp_ns, value, self._b)
        return None

    def _refuse_old(self, stamp_ns: int) -> None:
        oldest_ns = self._answered_ns + (0 if self._again else 1)
        if stamp_ns < max(oldest_ns, 0):
            raise StampError(
                f"stamp {stamp_ns} ns: not newer than {self._answered_ns} ns, answered before; "
                "stamps must rise"
            )

    def _forget_up_to(self, stamp_ns: int) -> None:
        self._answered_ns = stamp_ns
        for waiting in (self._a, self._b):
            while waiting and next(iter(waiting)) <= stamp_ns:
                waiting.popitem(last=False)


def _wait(stamp_ns: int, value: Any, stream: OrderedDict[int, Any]) -> None:
    stream[stamp_ns] = value
    if len(stream) > WAITING_LIMIT:
        stream.popitem(last=False)
