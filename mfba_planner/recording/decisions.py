# SPDX-License-Identifier: Apache-2.0
"""A bag's decisions with the sectors they answer, streamed: only what waits is held."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from typing import Any

from ..core.errors import BagError, InputError
from ..core.planner import Decision
from ..core.sensing import Ranges
from ..messages import decision, sector_ranges, stamp_ns
from .reader import BagReader

SECTORS, DECISION = "/sectors", "/planner/decision"
WAITING_LIMIT = 10_000  # messages of one kind that wait for the other; older ones are given up


def require_decisions(reader: BagReader) -> None:
    """Raise BagError for a bag that holds none."""
    for topic in (SECTORS, DECISION):
        if topic not in reader.topics or not reader.topics[topic].message_count:
            raise BagError(f"{reader.path}: holds no {topic}; give a bag `mfba run` recorded")


def stream_decisions(reader: BagReader) -> Iterator[tuple[Decision, Any]]:
    """Yield (decision, its sectors message) under rising stamps.

    Of several decisions on a stamp, the first: a later one only says that its inputs have
    become stale. Raises BagError for a bag without decisions, for one that is garbled, and
    where the sectors of a decision are missing.
    """
    require_decisions(reader)
    seen: OrderedDict[int, Any] = OrderedDict()
    waiting: OrderedDict[int, Any] = OrderedDict()
    last_ns = -1
    for message in reader.decoded([SECTORS, DECISION]):
        stamp = stamp_ns(message.message.header.stamp)
        if message.topic == SECTORS:
            seen[stamp] = message.message
            if len(seen) > WAITING_LIMIT:
                seen.popitem(last=False)
        elif stamp > last_ns:
            waiting.setdefault(stamp, message.message)
        while waiting and next(iter(waiting)) in seen:
            last_ns, diagnostics = waiting.popitem(last=False)
            yield _decision(reader, diagnostics, seen[last_ns]), seen[last_ns]
        if len(waiting) > WAITING_LIMIT:
            break
    if waiting:
        raise BagError(
            f"{reader.path}: no sectors at stamp {next(iter(waiting))} ns; was the bag edited?"
        )


def _decision(reader: BagReader, diagnostics: Any, sectors: Any) -> Decision:
    try:
        return decision(diagnostics, _seen(sectors))
    except InputError as error:
        raise BagError(f"{reader.path}: {error}") from None


def _seen(sectors: Any) -> Ranges:
    """What the planner made of a sectors message: nothing, where it refused it."""
    try:
        return sector_ranges(sectors)
    except InputError:
        return ()
