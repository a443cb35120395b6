# SPDX-License-Identifier: Apache-2.0
"""Chunks to one stream of messages in log-time order, holding only those that overlap."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple


class RawMessage(NamedTuple):
    """One message as recorded: CDR bytes, times in ns."""

    topic: str
    type_name: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int
    sequence: int


class Source(NamedTuple):
    """Messages not read yet, none of them earlier than `start_ns`."""

    start_ns: int
    load: Callable[[], list[RawMessage]]


def in_time_order(sources: Iterable[Source]) -> Iterator[RawMessage]:
    """All messages by log time; at equal times by the order of `sources`, then within them."""
    waiting = sorted(enumerate(sources), key=lambda item: item[1].start_ns, reverse=True)
    heap: list[tuple[int, int, RawMessage, Iterator[RawMessage]]] = []
    while waiting or heap:
        # A source that starts at the very time of the heap's head may come before it.
        while waiting and (not heap or waiting[-1][1].start_ns <= heap[0][0]):
            order, source = waiting.pop()
            rest = iter(sorted(source.load(), key=lambda message: message.log_time_ns))
            first = next(rest, None)
            if first is not None:
                heapq.heappush(heap, (first.log_time_ns, order, first, rest))
        if not heap:
            continue
        _, order, message, rest = heap[0]
        yield message
        following = next(rest, None)
        if following is None:
            heapq.heappop(heap)
        else:
            heapq.heapreplace(heap, (following.log_time_ns, order, following, rest))
