# SPDX-License-Identifier: Apache-2.0
"""What a bag says about each tick, joined by stamp; and what is wrong with that already."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from ..core.errors import InputError
from ..core.geometry import Point
from ..recording.bag_reader import BagReader, DecodedMessage
from ..recording.decisions import DECISION, SECTORS, ranges_of, require_decisions
from ..recording.from_messages import goal_point, stamp_ns, waypoint_points
from ..recording.omitted_decisions import left_out
from ..recording.robot_topics import messages_by_robot

ODOM, OBSTACLES, VECTOR, SCAN = "/odom", "/obstacles", "/sensory_vector", "/scan"
GOAL, WAYPOINTS = "/goal_pose", "/waypoints"
STEP, TWIST = "/goal_step", "/cmd_vel"
STAMPED = (ODOM, OBSTACLES, SECTORS, STEP, DECISION)
HEARD = (*STAMPED, SCAN, VECTOR, TWIST)


@dataclass(slots=True, kw_only=True)
class Tick:
    """All decoded messages of one stamp; None where the bag has none."""

    stamp_ns: int
    said: dict[str, Any] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class TickRecords:
    """The ticks in order of their stamps; faults speak against the bag, notes do not."""

    ticks: list[Tick]
    goals: list[Point]
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: frozenset[int] = frozenset()  # stamps of decisions after the end of their inputs


def collect(reader: BagReader, robots: Sequence[str]) -> dict[str, list[DecodedMessage]]:
    """All that speaks of each robot's ticks, in one pass.

    Raises BagError for a bag without decisions, and for one that cannot be read to its end.
    """
    require_decisions(reader, robots)
    found: dict[str, list[DecodedMessage]] = {robot: [] for robot in robots}
    for robot, message in messages_by_robot(reader, robots, (*HEARD, GOAL, WAYPOINTS)):
        found[robot].append(message)
    return found


def gather(
    messages: Iterable[DecodedMessage],
    tick_ns: int | None,
    frame: str = "",
    *,
    inputs: Sequence[str],
) -> TickRecords:
    """Join a robot's messages; tick_ns is the duration of a tick, None where it is not fixed.

    frame is the one that goals must be in, "" for any; inputs are what a decision is decided
    again on.
    """
    heard: dict[str, list[Any]] = {name: [] for name in HEARD}
    found = TickRecords(ticks=[], goals=[])
    latest: dict[str, int] = {}  # where in the bag each topic ends
    for place, message in enumerate(messages):
        latest[message.topic] = place
        if message.topic in (GOAL, WAYPOINTS):
            found.goals += _goals(message.topic, message.message, frame)
        else:
            heard[message.topic].append(message.message)
    ticks: dict[int, Tick] = {}
    for topic in (*STAMPED, SCAN):
        # In real time a later decision on a stamp only says that its inputs have become stale.
        all_alike = bool(tick_ns) or topic not in (DECISION, STEP)
        _join(found, ticks, topic, heard[topic], all_alike=all_alike)
    # No sensory vector follows where the sensor was blind.
    seen = [message for message in heard[SECTORS] if ranges_of(message)]
    _join_by_order(found, ticks, latest, SECTORS, seen, VECTOR, heard[VECTOR])
    steps, twists = heard[STEP], heard[TWIST]
    _join_by_order(found, ticks, latest, STEP, steps, TWIST, twists, all_alike=bool(tick_ns))
    found.ticks = [ticks[stamp] for stamp in sorted(ticks)]
    _leave_out(found, inputs)
    if tick_ns:
        _look_for_gaps(found, tick_ns, (*STAMPED, *([SCAN] if heard[SCAN] else []), TWIST))
    return found


def _goals(topic: str, message: Any, frame: str) -> tuple[Point, ...]:
    try:
        return (goal_point(message, frame),) if topic == GOAL else waypoint_points(message, frame)
    except InputError:  # the planner refused it as well
        return ()


def _join(
    found: TickRecords,
    ticks: dict[int, Tick],
    topic: str,
    messages: list[Any],
    *,
    all_alike: bool = True,
) -> None:
    before_ns, repeated = -1, 0
    for message in messages:
        stamp = stamp_ns(message.header.stamp)
        if stamp < before_ns:
            found.faults.append(f"{topic}: stamp {stamp} ns comes after {before_ns} ns")
        before_ns = max(before_ns, stamp)
        said = ticks.setdefault(stamp, Tick(stamp_ns=stamp)).said
        if topic not in said:
            said[topic] = message
        elif _content(topic, said[topic]) == _content(topic, message):
            repeated += 1
        elif all_alike:
            found.faults.append(f"{topic}: stamp {stamp} ns is there twice, and not alike")
    if repeated:
        found.notes.append(f"{topic}: {repeated} messages are there once more, all alike")


def _content(topic: str, message: Any) -> str:
    """What must not differ between two messages of one stamp, as text."""
    if topic == DECISION and message.status:
        status = message.status[0]
        told = {item.key: item.value for item in status.values if item.key != "refused_inputs"}
        return f"{status.message} {told}"
    return str(message)


def _join_by_order(
    found: TickRecords,
    ticks: dict[int, Tick],
    latest: dict[str, int],
    stamped: str,
    leaders: list[Any],
    topic: str,
    followers: list[Any],
    *,
    all_alike: bool = True,
) -> None:
    """Give messages without a stamp the one of the message that each of them followed.

    A node that was killed between the two may have left one of them alone, at their end.
    """
    if not leaders or not followers:
        return
    if hasattr(followers[0], "header"):
        _join(found, ticks, topic, followers, all_alike=all_alike)
        return
    surplus = len(leaders) - len(followers)
    if surplus:
        said = f"{topic}: {len(followers)} messages for {len(leaders)} on {stamped}"
        if surplus != (1 if latest[stamped] > latest[topic] else -1):
            found.faults.append(said)
            return
        found.notes.append(f"{said}, and the last one is alone (a node that was killed?)")
    for leader, follower in zip(leaders, followers):
        stamp = stamp_ns(leader.header.stamp)
        first = ticks[stamp].said.setdefault(topic, follower)
        if all_alike and str(first) != str(follower):
            found.faults.append(f"{topic}: stamp {stamp} ns is there twice, and not alike")


def _leave_out(found: TickRecords, inputs: Sequence[str]) -> None:
    """Name the decisions after the end of an input, as recording/omitted_decisions.py has it.

    Not where that would be all of them, nor for an input that was never recorded.
    """
    last_ns = {name: tick.stamp_ns for tick in found.ticks for name in tick.said}
    decided = [tick.stamp_ns for tick in found.ticks if DECISION in tick.said]
    ended = {
        name: last_ns[name] for name in inputs if last_ns.get(name, decided[-1]) < decided[-1]
    }
    stamps = [stamp for stamp in decided if any(last < stamp for last in ended.values())]
    if stamps and len(stamps) < len(decided):
        found.left_out = frozenset(stamps)
        found.notes.append(left_out(stamps, ended))


def _look_for_gaps(found: TickRecords, tick_ns: int, needed: tuple[str, ...]) -> None:
    """In lockstep each tick follows the other, and each has all its messages."""
    first = found.ticks[0].stamp_ns
    if first > tick_ns:
        found.notes.append(f"the recording begins at stamp {first} ns, not at tick 0")
    for a, b in pairwise(found.ticks):
        missing, rest = divmod(b.stamp_ns - a.stamp_ns, tick_ns)
        if rest:
            found.faults.append(f"stamp {b.stamp_ns} ns: no tick of {tick_ns} ns after the last")
        elif missing > 1:
            found.faults.append(
                f"{missing - 1} ticks are missing between {a.stamp_ns} and {b.stamp_ns} ns"
            )
    # The last tick may have been cut off, and the one before for those whose end it is.
    going_on = found.ticks[-1].said
    for tick, after in pairwise(found.ticks):
        heard_of = going_on if after is found.ticks[-1] else needed
        absent = [topic for topic in needed if topic in heard_of and topic not in tick.said]
        if absent and tick.stamp_ns not in found.left_out:
            found.faults.append(f"stamp {tick.stamp_ns} ns: no {', '.join(absent)}")
