# SPDX-License-Identifier: Apache-2.0
"""Join a bag's messages into ticks by stamp; find missing, repeated and unordered ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from ..core.errors import FrameError, InputError
from ..core.geometry import Point
from ..perception.known_map import KnownMap
from ..recording.bag_reader import BagReader, DecodedMessage
from ..recording.decisions_with_sectors import DECISION, SECTORS, ranges_of, require_decisions
from ..recording.decisions_without_inputs import omission_text, ragged_begin_text
from ..recording.fleet_topics import messages_by_robot
from ..recording.from_messages import goal_point, known_map_from, stamp_ns, waypoint_points

ODOM, OBSTACLES, VECTOR, SCAN = "/odom", "/obstacles", "/sensory_vector", "/scan"
GOAL, WAYPOINTS, MAP = "/goal_pose", "/waypoints", "/map"
STEP, TWIST = "/goal_step", "/cmd_vel"
STAMPED = (ODOM, OBSTACLES, SECTORS, STEP, DECISION)
TICK_TOPICS = (*STAMPED, SCAN, VECTOR, TWIST)


@dataclass(slots=True, kw_only=True)
class Tick:
    """The decoded messages of one stamp, by topic; scans by frame, of which there may be several.

    The first of them is in messages too.
    """

    stamp_ns: int
    messages: dict[str, Any] = field(default_factory=dict)
    scans: dict[str, Any] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class TickRecords:
    """The ticks sorted by stamp; faults are errors of the bag, notes are not."""

    ticks: list[Tick]
    goals: list[Point | None]  # None: of another frame, which the planner may have transformed
    known_map: KnownMap | None = None  # the first that the planner did not refuse
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    began_late: bool = False  # whether the planner ran before the recording began
    omitted_stamps: frozenset[int] = (
        frozenset()
    )  # stamps of decisions after the end of their inputs

    def scans(self) -> dict[tuple[str, int], Any]:
        """All scans, by frame and stamp."""
        return {
            (frame, tick.stamp_ns): message
            for tick in self.ticks
            for frame, message in tick.scans.items()
        }


def read_tick_messages(
    reader: BagReader, robots: Sequence[str]
) -> dict[str, list[DecodedMessage]]:
    """The messages that belong to each robot's ticks, by robot, read in one pass.

    Raises BagError for a bag without decisions, and for one that cannot be read completely.
    """
    require_decisions(reader, robots)
    records: dict[str, list[DecodedMessage]] = {robot: [] for robot in robots}
    for robot, message in messages_by_robot(reader, robots, (*TICK_TOPICS, GOAL, WAYPOINTS, MAP)):
        records[robot].append(message)
    return records


def join_ticks(
    messages: Iterable[DecodedMessage],
    tick_ns: int | None,
    frame: str = "",
    *,
    inputs: Sequence[str],
    is_simulated: bool = True,
) -> TickRecords:
    """Join a robot's messages into ticks; tick_ns is the tick duration, None in real time.

    `frame` is the required frame of goals, "" for any. `inputs` are the topics that a decision
    needs to be decided again. A robot that is not simulated may have no topic of obstacles.
    """
    by_topic: dict[str, list[Any]] = {name: [] for name in TICK_TOPICS}
    records = TickRecords(ticks=[], goals=[])
    positions: dict[str, list[int]] = {name: [] for name in TICK_TOPICS}  # in the bag, by topic
    for index, message in enumerate(messages):
        if message.topic in (GOAL, WAYPOINTS):
            records.goals += _goals(message.topic, message.message, frame)
        elif message.topic == MAP:
            records.known_map = records.known_map or _known_map(message.message, frame)
        else:
            by_topic[message.topic].append(message.message)
            positions[message.topic].append(index)
    ticks: dict[int, Tick] = {}
    begun_ns = _begun_ns(by_topic)
    for topic in (*STAMPED, SCAN):
        # In real time a later decision on a stamp only reports stale inputs.
        must_match = bool(tick_ns) or topic not in (DECISION, STEP)
        _join_stamped(records, ticks, topic, by_topic[topic], begun_ns, must_match=must_match)
    # A blind sensor publishes no sensory vector.
    sectors = [item for item in zip(positions[SECTORS], by_topic[SECTORS]) if ranges_of(item[1])]
    steps, twists, vectors = (
        list(zip(positions[name], by_topic[name])) for name in (STEP, TWIST, VECTOR)
    )
    records.began_late = bool(begun_ns) or bool(tick_ns and min(ticks) > tick_ns)
    not_joined = set()
    for stamped_topic, stamped, topic, unstamped in (
        (SECTORS, sectors, VECTOR, vectors), (STEP, steps, TWIST, twists)
    ):  # fmt: skip
        # In real time nothing tells whether the first messages were recorded.
        may_lack_first = records.began_late or not tick_ns
        if begun_ns or (may_lack_first and not _alternate(stamped, unstamped)):
            not_joined.add(topic)
            records.notes.append(
                f"{topic}: has no stamps, and not all of it was recorded; it is not checked"
            )
            continue
        _join_unstamped(
            records, ticks, stamped_topic, stamped, topic, unstamped, must_match=bool(tick_ns)
        )
    records.ticks = [ticks[stamp] for stamp in sorted(ticks)]
    _omit_decisions(records, inputs)
    if tick_ns:
        also = [SCAN] if by_topic[SCAN] else []
        also += [] if TWIST in not_joined else [TWIST]
        is_left_out = not is_simulated and not by_topic[OBSTACLES]
        needed = [topic for topic in STAMPED if not (is_left_out and topic == OBSTACLES)]
        _check_gaps(records, tick_ns, (*needed, *also))
    return records


def _goals(topic: str, message: Any, frame: str) -> Sequence[Point | None]:
    try:
        return (goal_point(message, frame),) if topic == GOAL else waypoint_points(message, frame)
    except FrameError:
        return [None] if topic == GOAL else [None] * len(message.poses)
    except InputError:  # the planner refused it too
        return ()


def _known_map(message: Any, frame: str) -> KnownMap | None:
    try:
        return known_map_from(message, frame)
    except InputError:  # the planner refused it too
        return None


def _begun_ns(by_topic: Mapping[str, Sequence[Any]]) -> int:
    """The stamp at which the last of the stamped topics began, ns.

    A recorder that has just found a topic may write its first messages in another sequence.
    """
    stamped = (by_topic[name] for name in STAMPED)
    firsts = [stamp_ns(messages[0].header.stamp) for messages in stamped if messages]
    return max(firsts) if len(set(firsts)) > 1 else 0


def _join_stamped(
    records: TickRecords,
    ticks: dict[int, Tick],
    topic: str,
    messages: list[Any],
    begun_ns: int = 0,
    *,
    must_match: bool = True,
) -> None:
    repeated = 0
    latest: dict[str, int] = {}  # of scans by frame: each lidar's stamps rise
    for message in messages:
        stamp = stamp_ns(message.header.stamp)
        lidar = message.header.frame_id if topic == SCAN else ""
        latest_ns = latest.get(lidar, -1)
        if begun_ns <= stamp < latest_ns:
            records.faults.append(f"{topic}: stamp {stamp} ns comes after {latest_ns} ns")
        latest[lidar] = max(latest_ns, stamp)
        tick = ticks.setdefault(stamp, Tick(stamp_ns=stamp))
        first = tick.messages.setdefault(topic, message)
        if topic == SCAN:
            first = tick.scans.setdefault(lidar, message)
        if first is message:
            continue
        if _content(topic, first) == _content(topic, message):
            repeated += 1
        elif must_match:
            records.faults.append(f"{topic}: stamp {stamp} ns is repeated with other content")
    if repeated:
        records.notes.append(f"{topic}: {repeated} repeated messages, all identical")


def _content(topic: str, message: Any) -> str:
    """The content in which two messages of one stamp must not differ, as text."""
    if topic == DECISION and message.status:
        status = message.status[0]
        fields = {item.key: item.value for item in status.values if item.key != "refused_inputs"}
        return f"{status.message} {fields}"
    return str(message)


def _alternate(stamped: list[tuple[int, Any]], unstamped: list[tuple[int, Any]]) -> bool:
    """Whether the first message without stamp follows the first stamped one; also without any."""
    return not unstamped or sum(position < unstamped[0][0] for position, _ in stamped) == 1


def _join_unstamped(
    records: TickRecords,
    ticks: dict[int, Tick],
    stamped_topic: str,
    stamped: list[tuple[int, Any]],
    topic: str,
    unstamped: list[tuple[int, Any]],
    *,
    must_match: bool,
) -> None:
    """Join messages without stamp: each gets the stamp of the message it followed.

    Both are given with their positions in the bag. A node that was killed between the two may have
    left the last one unpaired.
    """
    if not stamped or not unstamped:
        return
    if hasattr(unstamped[0][1], "header"):
        messages = [message for _, message in unstamped]
        _join_stamped(records, ticks, topic, messages, must_match=must_match)
        return
    surplus = len(stamped) - len(unstamped)
    if surplus:
        text = f"{topic}: {len(unstamped)} messages for {len(stamped)} on {stamped_topic}"
        if surplus != (1 if stamped[-1][0] > unstamped[-1][0] else -1):
            # In real time a message may be lost, and which one is not known.
            (records.faults if must_match else records.notes).append(text)
            return
        records.notes.append(f"{text}, and the last one is unpaired (was a node killed?)")
    for (_, message), (_, other) in zip(stamped, unstamped):
        stamp = stamp_ns(message.header.stamp)
        first = ticks[stamp].messages.setdefault(topic, other)
        if must_match and str(first) != str(other):
            records.faults.append(f"{topic}: stamp {stamp} ns is repeated with other content")


def _omit_decisions(records: TickRecords, inputs: Sequence[str]) -> None:
    """Note decisions outside the recording of an input, see recording/decisions_without_inputs.py.

    Not if these are all decisions, nor for an input that was never recorded.
    """
    last_ns = {name: tick.stamp_ns for tick in records.ticks for name in tick.messages}
    first_ns = {name: tick.stamp_ns for tick in records.ticks[::-1] for name in tick.messages}
    decided = [tick.stamp_ns for tick in records.ticks if DECISION in tick.messages]
    ended = {
        name: last_ns[name] for name in inputs if last_ns.get(name, decided[-1]) < decided[-1]
    }
    begun = {
        name: first_ns[name] for name in inputs if first_ns.get(name, decided[0]) > decided[0]
    }
    late = [stamp for stamp in decided if any(last < stamp for last in ended.values())]
    early = [stamp for stamp in decided if any(stamp < first for first in begun.values())]
    if len({*early, *late}) == len(decided):
        return
    records.omitted_stamps = frozenset((*early, *late))
    if early:
        records.notes.append(ragged_begin_text(early, begun))
    if late:
        records.notes.append(omission_text(late, ended))


def _whole_from(ticks: Sequence[Tick], needed: tuple[str, ...]) -> int:
    """The index of the first tick from which on every needed topic was recorded, 0 if none."""
    begun: set[str] = set()
    for index, tick in enumerate(ticks):
        begun.update(name for name in needed if name in tick.messages)
        if len(begun) == len(needed):
            return index
    return 0


def _check_gaps(records: TickRecords, tick_ns: int, needed: tuple[str, ...]) -> None:
    """Lockstep: find missing ticks, and ticks with missing messages."""
    first = records.ticks[0].stamp_ns
    begin = 0
    if first > tick_ns:
        records.notes.append(f"the recording starts at stamp {first} ns, not at tick 0")
        begin = _whole_from(records.ticks, needed)
    for a, b in pairwise(records.ticks):
        ticks_apart, rest = divmod(b.stamp_ns - a.stamp_ns, tick_ns)
        if rest:
            records.faults.append(f"stamp {b.stamp_ns} ns: not {tick_ns} ns after the last tick")
        elif ticks_apart > 1:
            records.faults.append(
                f"{ticks_apart - 1} ticks are missing between {a.stamp_ns} and {b.stamp_ns} ns"
            )
    # The recording may end within the last tick. A topic that is missing there may have ended
    # one tick earlier.
    last_messages = records.ticks[-1].messages
    for tick, after in pairwise(records.ticks[begin:]):
        expected = last_messages if after is records.ticks[-1] else needed
        missing = [topic for topic in needed if topic in expected and topic not in tick.messages]
        if missing and tick.stamp_ns not in records.omitted_stamps:
            records.faults.append(f"stamp {tick.stamp_ns} ns: no {', '.join(missing)}")
