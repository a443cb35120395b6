# SPDX-License-Identifier: Apache-2.0
"""Messages of two topics joined by stamp: each stamp once, stamps rising."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, Generic, TypeVar

from ...core.errors import StampError

A = TypeVar("A")
B = TypeVar("B")

WAITING_LIMIT = 10_000  # messages of one topic that may wait for their partner


class StampPairs(Generic[A, B]):
    """Join topic a with topic b; a pair is returned as soon as both messages are received.

    With `repeat`, the last pair is returned again when both its messages are received again.
    """

    def __init__(self, *, repeat: bool = False, limit: int | None = None, kept: int = 0) -> None:
        """Start with nothing waiting; limit replaces WAITING_LIMIT.

        So many messages of topic a, with the newest stamps, are kept for several of topic b.
        """
        self._repeat, self._kept = repeat, kept
        self._limit = WAITING_LIMIT if limit is None else limit
        self._a: OrderedDict[int, A] = OrderedDict()
        self._b: OrderedDict[int, B] = OrderedDict()
        self._paired_ns = -1

    def add_a(self, stamp_ns: int, value: A) -> tuple[A, B] | None:
        """Add a message of topic a; StampError for a stamp that was paired before."""
        self._refuse_old(stamp_ns)
        if stamp_ns in self._b:
            pair = (value, self._b[stamp_ns])
            if self._kept:
                self._keep(stamp_ns, value, self._a)
            self._drop_up_to(stamp_ns)
            return pair
        self._keep(stamp_ns, value, self._a)
        return None

    def add_b(self, stamp_ns: int, value: B) -> tuple[A, B] | None:
        """Add a message of topic b; StampError for a stamp that was paired before."""
        if not (self._kept and stamp_ns in self._a):
            self._refuse_old(stamp_ns)
        if stamp_ns in self._a:
            pair = (self._a[stamp_ns], value)
            self._drop_up_to(stamp_ns)
            return pair
        self._keep(stamp_ns, value, self._b)
        return None

    def _refuse_old(self, stamp_ns: int) -> None:
        oldest_ns = self._paired_ns + (0 if self._repeat else 1)
        if stamp_ns < max(oldest_ns, 0):
            raise StampError(
                f"stamp {stamp_ns} ns: not newer than {self._paired_ns} ns, answered before; "
                "stamps must rise"
            )

    def _drop_up_to(self, stamp_ns: int) -> None:
        self._paired_ns = max(stamp_ns, self._paired_ns)
        for waiting, kept in ((self._a, self._kept), (self._b, 0)):
            while len(waiting) > kept and next(iter(waiting)) <= stamp_ns:
                waiting.popitem(last=False)

    def _keep(self, stamp_ns: int, value: Any, waiting: OrderedDict[int, Any]) -> None:
        waiting[stamp_ns] = value
        if len(waiting) > self._limit:
            waiting.popitem(last=False)
