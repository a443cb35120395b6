# SPDX-License-Identifier: Apache-2.0
"""The valid log times of a bag: without those that a writer left unset.

Some writers leave 0 or the largest number. 0 is valid in a bag in simulated time, which starts
there, and unset in a bag of wall times.
"""

from __future__ import annotations

from collections.abc import Iterable

from .bag_metadata import NO_TIME_NS
from .storage_file import Span

WALL_TIME_NS = 10 * 365 * 86400 * 10**9  # from here on: longer than any simulation
_ALL = frozenset(range(1 << 16))  # channel ids of MCAP; other files have fewer


class LogTimes:
    """The first and the last valid log time, None for a bag without messages."""

    def __init__(self, spans: Iterable[Span]) -> None:
        """Read the parts of a bag that may hold an unset time."""
        bounds: list[tuple[int, int]] = []
        has_zero = False
        for span in spans:
            if span.start_ns > 0 and span.end_ns < NO_TIME_NS:
                bounds.append((span.start_ns, span.end_ns))
                continue
            times = [m.log_time_ns for m in span.load(_ALL)]
            has_zero = has_zero or 0 in times
            known = [t for t in times if 0 < t < NO_TIME_NS]
            if known:
                bounds.append((min(known), max(known)))
        self.start_ns = min((start for start, _ in bounds), default=None)
        self.end_ns = max((end for _, end in bounds), default=None)
        if has_zero and (self.start_ns is None or self.start_ns < WALL_TIME_NS):
            self.start_ns, self.end_ns = 0, self.end_ns or 0

    def is_valid(self, time_ns: int) -> bool:
        """Whether a log time is set."""
        return (self.start_ns or 0) <= time_ns <= (self.end_ns or 0)

    def valid(self, time_ns: int) -> int:
        """The nearest valid log time."""
        return min(max(time_ns, self.start_ns or 0), self.end_ns or 0)
