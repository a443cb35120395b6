# SPDX-License-Identifier: Apache-2.0
"""Stream a bag's decisions, each with its sectors message of the same stamp."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ..core.errors import BagError, InputError
from ..core.planner_types import Decision, Ranges
from .bag_reader import BagReader, DecodedMessage
from .decisions_without_inputs import omission_text, ragged_begin_text, undecided_text
from .fleet_topics import NO_NAMESPACE, messages_by_robot, robot_topic, with_robot_name
from .from_messages import decision, sector_ranges, stamp_ns

SECTORS, DECISION = "/sectors", "/planner/decision"
MAX_WAITING = 10_000  # sectors without decision, decisions without sectors, matched stamps: each


class RecordedDecision(NamedTuple):
    """A decision, the sectors message of its stamp, and the robot ("" without namespace)."""

    decision: Decision
    sectors: Any
    robot: str = NO_NAMESPACE


def robots_with_decisions(reader: BagReader) -> list[str]:
    """Names of the robots with decisions in a bag; [NO_NAMESPACE] if none has a name."""
    found = [name for name in reader.topics if name.endswith(DECISION)]
    names = [name.removesuffix(DECISION).lstrip("/") for name in found]
    return [NO_NAMESPACE] if NO_NAMESPACE in names else names or [NO_NAMESPACE]


def require_decisions(reader: BagReader, robots: Sequence[str] = (NO_NAMESPACE,)) -> None:
    """Raise BagError if the decisions or sectors of one of these robots are missing."""
    for topic in (robot_topic(robot, topic) for robot in robots for topic in (SECTORS, DECISION)):
        if topic not in reader.topics or not reader.topics[topic].message_count:
            raise BagError(f"{reader.path}: holds no {topic}; give a bag `mfba run` recorded")


def stream_decisions(
    reader: BagReader, robots: Sequence[str], omitted: dict[str, str]
) -> Iterator[RecordedDecision]:
    """Yield each robot's decisions in bag sequence, one per stamp, in one pass.

    Of several decisions on a stamp the first is used: a later one only reports stale inputs.
    Decisions before the first and after the last sectors are omitted; at the end a note about
    them is stored by robot in the last argument. Raises BagError for a bag without decisions, for
    a malformed decision, and if the sectors of a decision are missing in between.
    """
    require_decisions(reader, robots)
    pairs = {robot: _StampMatching() for robot in robots}
    for robot, message in messages_by_robot(reader, robots, (SECTORS, DECISION)):
        pair = pairs[robot].add(message)
        if pair is not None:
            diagnostics, sectors = pair
            yield RecordedDecision(_decision(reader, diagnostics, sectors), sectors, robot)
        if len(pairs[robot].decisions) > MAX_WAITING:
            raise _missing_sectors(reader, robot, next(iter(pairs[robot].decisions)))
    for robot, matching in pairs.items():
        early = [stamp for stamp in matching.decisions if matching.sectors_began_after(stamp)]
        late = [stamp for stamp in matching.decisions if matching.sectors_ended_before(stamp)]
        for stamp in matching.decisions:
            if stamp not in early and stamp not in late:
                raise _missing_sectors(reader, robot, stamp)
        notes = []
        if early:
            notes.append(ragged_begin_text(early, [SECTORS]))
        elif count := matching.sectors_before_decisions:
            notes.append(undecided_text(count))
        if late:
            notes.append(omission_text(late, [SECTORS]))
        if notes:
            omitted[robot] = "; ".join(notes)


def _missing_sectors(reader: BagReader, robot: str, stamp: int) -> BagError:
    text = with_robot_name(robot, f"no sectors at stamp {stamp} ns; was the bag edited?")
    return BagError(f"{reader.path}: {text}")


class _StampMatching:
    """Match the decisions and sectors of one robot by stamp."""

    def __init__(self) -> None:
        self.sectors: OrderedDict[int, Any] = OrderedDict()
        self.decisions: OrderedDict[int, Any] = OrderedDict()
        self._matched: OrderedDict[int, None] = OrderedDict()
        self._unmatched = {SECTORS: self.sectors, DECISION: self.decisions}
        self._first_sectors_ns = self._last_sectors_ns = -1
        self._first_decision_ns: int | None = None
        self.sectors_before_decisions = 0

    def sectors_began_after(self, stamp: int) -> bool:
        """Whether pairs were matched, but the first sectors are newer than this stamp."""
        return bool(self._matched) and stamp < self._first_sectors_ns

    def sectors_ended_before(self, stamp: int) -> bool:
        """Whether pairs were matched, but the latest sectors are older than this stamp."""
        return bool(self._matched) and self._last_sectors_ns < stamp

    def add(self, message: DecodedMessage) -> tuple[Any, Any] | None:
        """Add the next message; (decision, sectors) once both are present, else None."""
        stamp = stamp_ns(message.message.header.stamp)
        if message.topic == SECTORS:
            if self._first_sectors_ns < 0:
                self._first_sectors_ns = stamp
            self._last_sectors_ns = max(self._last_sectors_ns, stamp)
        elif self._first_decision_ns is None:
            self._first_decision_ns = stamp
            self.sectors_before_decisions = sum(known < stamp for known in self.sectors)
        if stamp in self._matched:
            return None
        self._unmatched[message.topic].setdefault(stamp, message.message)
        pair = None
        if stamp in self.sectors and stamp in self.decisions:
            self._matched[stamp] = None
            pair = self.decisions.pop(stamp), self.sectors.pop(stamp)
        for by_stamp in (self.sectors, self._matched):
            if len(by_stamp) > MAX_WAITING:
                by_stamp.popitem(last=False)
        return pair


def rising_decisions(
    reader: BagReader, robots: Sequence[str], omitted: dict[str, str]
) -> Iterator[RecordedDecision]:
    """As stream_decisions; also raises BagError if a robot's stamp decreases."""
    last_ns = dict.fromkeys(robots, -1)
    for recorded in stream_decisions(reader, robots, omitted):
        stamp, before_ns = recorded.decision.stamp_ns, last_ns[recorded.robot]
        if stamp < before_ns:
            raise BagError(
                f"{reader.path}: the decision at stamp {stamp} ns comes after that at "
                f"{before_ns} ns; run `mfba verify` to list what else was edited"
            )
        last_ns[recorded.robot] = stamp
        yield recorded


def ranges_of(sectors: Any) -> Ranges:
    """The ranges of a sectors message; () if the planner refused the message."""
    try:
        return sector_ranges(sectors)
    except InputError:
        return ()


def _decision(reader: BagReader, diagnostics: Any, sectors: Any) -> Decision:
    try:
        return decision(diagnostics, ranges_of(sectors))
    except InputError as error:
        raise BagError(f"{reader.path}: {error}") from None
