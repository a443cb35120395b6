# SPDX-License-Identifier: Apache-2.0
"""A bag's decisions with the sectors they answer, streamed: only what waits is held."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ..core.errors import BagError, InputError
from ..core.types import Decision, Ranges
from .bag_reader import BagReader, DecodedMessage
from .from_messages import decision, sector_ranges, stamp_ns
from .omitted_decisions import left_out
from .robot_topics import NO_NAMESPACE, below, messages_by_robot, of_robot

SECTORS, DECISION = "/sectors", "/planner/decision"
REMEMBERED = 10_000  # of sectors without a decision, of decisions without sectors, of stamps


class RecordedDecision(NamedTuple):
    """A decision, the sectors message it answers, and who decided."""

    decision: Decision
    sectors: Any
    robot: str = NO_NAMESPACE


def robots_with_decisions(reader: BagReader) -> list[str]:
    """The robots whose decisions are in a bag, as its topics have them; ALONE where none is."""
    found = [name for name in reader.topics if name.endswith(DECISION)]
    names = [name.removesuffix(DECISION).lstrip("/") for name in found]
    return [NO_NAMESPACE] if NO_NAMESPACE in names else names or [NO_NAMESPACE]


def require_decisions(reader: BagReader, robots: Sequence[str] = (NO_NAMESPACE,)) -> None:
    """Raise BagError for a bag that holds none of one of these robots."""
    for topic in (below(robot, topic) for robot in robots for topic in (SECTORS, DECISION)):
        if topic not in reader.topics or not reader.topics[topic].message_count:
            raise BagError(f"{reader.path}: holds no {topic}; give a bag `mfba run` recorded")


def stream_decisions(
    reader: BagReader, robots: Sequence[str], missed: dict[str, str]
) -> Iterator[RecordedDecision]:
    """Yield each robot's decisions in the order of the bag, one for each stamp, in one pass.

    The first counts: a later one on its stamp only says that its inputs have become stale. Those
    that came after the last sectors of the bag are left out, which `missed` says by robot in the
    end. Raises BagError for a bag without decisions, for one that is garbled, and where the
    sectors of a decision are missing though later ones are there.
    """
    require_decisions(reader, robots)
    pairs = {robot: _Pairs() for robot in robots}
    for robot, message in messages_by_robot(reader, robots, (SECTORS, DECISION)):
        pair = pairs[robot].take(message)
        if pair is not None:
            said, sectors = pair
            yield RecordedDecision(_decision(reader, said, sectors), sectors, robot)
        if len(pairs[robot].decisions) > REMEMBERED:
            raise _hole(reader, robot, next(iter(pairs[robot].decisions)))
    for robot, waiting in pairs.items():
        for stamp in waiting.decisions:
            if not waiting.ended_before(stamp):
                raise _hole(reader, robot, stamp)
        if waiting.decisions:
            missed[robot] = left_out(waiting.decisions, [SECTORS])


def _hole(reader: BagReader, robot: str, stamp: int) -> BagError:
    said = of_robot(robot, f"no sectors at stamp {stamp} ns; was the bag edited?")
    return BagError(f"{reader.path}: {said}")


class _Pairs:
    """Decisions and sectors of one robot that wait for each other, by stamp."""

    def __init__(self) -> None:
        self.sectors: OrderedDict[int, Any] = OrderedDict()
        self.decisions: OrderedDict[int, Any] = OrderedDict()
        self._answered: OrderedDict[int, None] = OrderedDict()
        self._waiting = {SECTORS: self.sectors, DECISION: self.decisions}
        self._last_sectors_ns = -1

    def ended_before(self, stamp: int) -> bool:
        """Whether there were sectors with their decisions, but none as late as this stamp."""
        return bool(self._answered) and self._last_sectors_ns < stamp

    def take(self, message: DecodedMessage) -> tuple[Any, Any] | None:
        """Take the next message; (decision, sectors) where both have come now."""
        stamp = stamp_ns(message.message.header.stamp)
        if message.topic == SECTORS:
            self._last_sectors_ns = max(self._last_sectors_ns, stamp)
        if stamp in self._answered:
            return None
        self._waiting[message.topic].setdefault(stamp, message.message)
        pair = None
        if stamp in self.sectors and stamp in self.decisions:
            self._answered[stamp] = None
            pair = self.decisions.pop(stamp), self.sectors.pop(stamp)
        for kept in (self.sectors, self._answered):
            if len(kept) > REMEMBERED:
                kept.popitem(last=False)
        return pair


def rising_decisions(
    reader: BagReader, robots: Sequence[str], missed: dict[str, str]
) -> Iterator[RecordedDecision]:
    """stream_decisions; raises BagError where a robot's stamp goes back."""
    last_ns = dict.fromkeys(robots, -1)
    for answer in stream_decisions(reader, robots, missed):
        stamp, before_ns = answer.decision.stamp_ns, last_ns[answer.robot]
        if stamp < before_ns:
            raise BagError(
                f"{reader.path}: the decision at stamp {stamp} ns comes after that at "
                f"{before_ns} ns; `mfba verify` says what else was edited"
            )
        last_ns[answer.robot] = stamp
        yield answer


def ranges_of(sectors: Any) -> Ranges:
    """What the planner made of a sectors message: nothing, where it refused it."""
    try:
        return sector_ranges(sectors)
    except InputError:
        return ()


def _decision(reader: BagReader, diagnostics: Any, sectors: Any) -> Decision:
    try:
        return decision(diagnostics, ranges_of(sectors))
    except InputError as error:
        raise BagError(f"{reader.path}: {error}") from None
