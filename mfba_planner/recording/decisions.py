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
REMEMBERED = 10_000  # of sectors without a decision, of decisions without sectors, of stamps

Answered = tuple[Decision, Any]


def require_decisions(reader: BagReader, namespace: str = "") -> None:
    """Raise BagError for a bag that holds none, or not in this namespace."""
    if DECISION not in reader.topics and not namespace and _robots(reader):
        raise of_a_fleet(reader)
    for topic in (namespace + SECTORS, namespace + DECISION):
        if topic not in reader.topics or not reader.topics[topic].message_count:
            raise BagError(f"{reader.path}: holds no {topic}; give a bag `mfba run` recorded")


def of_a_fleet(reader: BagReader) -> BagError:
    """What is said by whoever reads one robot's decisions only."""
    return BagError(
        f"{reader.path}: holds {_robots(reader)} robots, and a bag of one is read here; take "
        "their results, or mfba_planner.recording.fleet.read_fleet"
    )


def _robots(reader: BagReader) -> int:
    return sum(name.endswith(DECISION) for name in reader.topics)


def stream_decisions(reader: BagReader, namespace: str = "") -> Iterator[Answered]:
    """Yield (decision, its sectors message) in the order of the bag, one for each stamp.

    namespace is a fleet's robot's, "/NAME".

    The first counts: a later one on its stamp only says that its inputs have become stale.
    Raises BagError for a bag without decisions, for one that is garbled, and where the sectors
    of a decision are missing.
    """
    require_decisions(reader, namespace)
    waiting: dict[str, OrderedDict[int, Any]] = {
        namespace + SECTORS: OrderedDict(),
        namespace + DECISION: OrderedDict(),
    }
    sectors, decisions = waiting.values()
    answered: OrderedDict[int, None] = OrderedDict()
    for message in reader.decoded(waiting):
        stamp = stamp_ns(message.message.header.stamp)
        if stamp in answered:
            continue
        waiting[message.topic].setdefault(stamp, message.message)
        if stamp in sectors and stamp in decisions:
            answered[stamp] = None
            seen = sectors.pop(stamp)
            yield _decision(reader, decisions.pop(stamp), seen), seen
        for kept in (sectors, answered):
            if len(kept) > REMEMBERED:
                kept.popitem(last=False)
        if len(decisions) > REMEMBERED:
            break
    if decisions:
        raise BagError(
            f"{reader.path}: no sectors at stamp {next(iter(decisions))} ns; was the bag edited?"
        )


def rising_decisions(reader: BagReader) -> Iterator[Answered]:
    """stream_decisions; raises BagError where a stamp goes back."""
    last_ns = -1
    for found, sectors in stream_decisions(reader):
        if found.stamp_ns < last_ns:
            raise BagError(
                f"{reader.path}: the decision at stamp {found.stamp_ns} ns comes after that at "
                f"{last_ns} ns; `mfba verify` says what else was edited"
            )
        last_ns = found.stamp_ns
        yield found, sectors


def ranges_seen(sectors: Any) -> Ranges:
    """What the planner made of a sectors message: nothing, where it refused it."""
    try:
        return sector_ranges(sectors)
    except InputError:
        return ()


def _decision(reader: BagReader, diagnostics: Any, sectors: Any) -> Decision:
    try:
        return decision(diagnostics, ranges_seen(sectors))
    except InputError as error:
        raise BagError(f"{reader.path}: {error}") from None
