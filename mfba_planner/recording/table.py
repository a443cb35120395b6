# SPDX-License-Identifier: Apache-2.0
"""A bag's ticks as one tidy table, a row per decision, streamed: only what waits is held."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from typing import Any

from ..core.errors import BagError, InputError
from ..core.planner import NANO
from ..core.sensing import Ranges
from ..messages import bits_text, decision, sector_ranges, stamp_ns
from .reader import BagReader

SECTORS, DECISION = "/sectors", "/planner/decision"
WAITING_LIMIT = 10_000  # sectors whose decision has not come; older ones are given up

Row = dict[str, Any]

# name: (type, meaning); the ranges of the sectors follow as range_1, range_2, ...
COLUMNS: dict[str, tuple[type, str]] = {
    "stamp_ns": (int, "stamp of the tick, ns"),
    "time_s": (float, "time since the first row's stamp, s"),
    "mode": (str, "mode of the planner"),
    "reason": (str, "why it decided so"),
    "x": (float, "pose, m"),
    "y": (float, "pose, m"),
    "yaw": (float, "pose, rad"),
    "goal_x": (float, "goal, m; empty without one"),
    "goal_y": (float, "goal, m; empty without one"),
    "waypoint_x": (float, "chosen next point, m"),
    "waypoint_y": (float, "chosen next point, m"),
    "velocity_x": (float, "velocity in the odom frame, m/s"),
    "velocity_y": (float, "velocity in the odom frame, m/s"),
    "gap": (int, "chosen gap, from 1; 0 is none"),
    "vs": (str, "sensory vector (eq. 11), sector 1 first"),
    "vg": (str, "gap vector (eq. 13), gap 1 first"),
}


def read_rows(reader: BagReader) -> Iterator[Row]:
    """Yield the rows in the order of the bag; a stamp's first decision only.

    Raises BagError for a bag without decisions, or whose sectors are missing.
    """
    for topic in (SECTORS, DECISION):
        if topic not in reader.topics or not reader.topics[topic].message_count:
            raise BagError(f"{reader.path}: holds no {topic}; give a bag `mfba run` recorded")
    seen: OrderedDict[int, Any] = OrderedDict()
    early: OrderedDict[int, Any] = OrderedDict()  # decisions read before their sectors
    first_ns = last_ns = -1
    for message in reader.decoded([SECTORS, DECISION]):
        stamp = stamp_ns(message.message.header.stamp)
        if message.topic == SECTORS:
            seen[stamp] = message.message
            if len(seen) > WAITING_LIMIT:
                seen.popitem(last=False)
        else:
            early.setdefault(stamp, message.message)
        while early and next(iter(early)) in seen:
            answered, diagnostics = early.popitem(last=False)
            if answered > last_ns:
                first_ns = answered if first_ns < 0 else first_ns
                last_ns = answered
                yield _row(reader, diagnostics, seen[answered], first_ns)
        if len(early) > WAITING_LIMIT:
            break
    if any(stamp > last_ns for stamp in early):
        raise BagError(
            f"{reader.path}: no sectors at stamp {next(iter(early))} ns; was the bag edited?"
        )


def _ranges(sectors: Any) -> Ranges:
    try:
        return sector_ranges(sectors)
    except InputError:  # the sensor was blind
        return ()


def _row(reader: BagReader, diagnostics: Any, sectors: Any, first_ns: int) -> Row:
    try:
        found = decision(diagnostics, _ranges(sectors))
    except InputError as error:
        raise BagError(f"{reader.path}: {error}") from None
    goal = found.goal or (None, None)
    return {
        "stamp_ns": found.stamp_ns,
        "time_s": (found.stamp_ns - first_ns) * NANO,
        "mode": found.mode.value,
        "reason": found.reason,
        **dict(zip(("x", "y", "yaw"), found.pose)),
        "goal_x": goal[0],
        "goal_y": goal[1],
        **dict(zip(("waypoint_x", "waypoint_y"), found.waypoint)),
        **dict(zip(("velocity_x", "velocity_y"), found.velocity)),
        "gap": found.gap,
        "vs": bits_text(found.vs),
        "vg": bits_text(found.vg),
        **{f"range_{number}": value for number, value in enumerate(sectors.ranges, start=1)},
    }
