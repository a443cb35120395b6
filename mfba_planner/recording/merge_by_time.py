# SPDX-License-Identifier: Apache-2.0
"""Merge chunks into one stream of messages by log time; holds only chunks that overlap."""

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
    """Messages that `load` reads later, none of them earlier than `start_ns`.

    If they are sorted by log time, they are not read all at once.
    """

    start_ns: int
    load: Callable[[], Iterable[RawMessage]]
    is_sorted: bool = False


def merge_by_log_time(sources: Iterable[Source]) -> Iterator[RawMessage]:
    """All messages sorted by log time; at equal times in the sequence of `sources`, stable."""
    unread = sorted(enumerate(sources), key=lambda item: item[1].start_ns, reverse=True)
    heap: list[tuple[int, int, RawMessage, Iterator[RawMessage]]] = []
    while unread or heap:
        # A source that starts at the same time as the heap's head may precede it.
        while unread and (not heap or unread[-1][1].start_ns <= heap[0][0]):
            index, source = unread.pop()
            messages = source.load()
            if not source.is_sorted:
                messages = sorted(messages, key=lambda message: message.log_time_ns)
            rest = iter(messages)
            first = next(rest, None)
            if first is not None:
                heapq.heappush(heap, (first.log_time_ns, index, first, rest))
        if not heap:
            continue
        _, index, message, rest = heap[0]
        yield message
        following = next(rest, None)
        if following is None:
            heapq.heappop(heap)
        else:
            heapq.heapreplace(heap, (following.log_time_ns, index, following, rest))
