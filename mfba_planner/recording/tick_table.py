# SPDX-License-Identifier: Apache-2.0
"""A bag's ticks as one tidy table, a row per decision, streamed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from ..core.types import NANO
from ..perception.sensory_vector import bits_text
from .bag_reader import BagReader
from .decisions import RecordedDecision, rising_decisions
from .robot_topics import NO_NAMESPACE

Row = dict[str, Any]

# name: (type, meaning); the ranges of the sectors follow as range_1, range_2, ...
COLUMNS: dict[str, tuple[type, str]] = {
    "robot": (str, "whose row it is; of fleets only"),
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


def read_rows(reader: BagReader, robots: Sequence[str], missed: dict[str, str]) -> Iterator[Row]:
    """Yield the rows under rising stamps, those of a stamp in the order of robots.

    Leaves out and raises BagError as rising_decisions does.
    """
    first_ns: int | None = None
    answers = rising_decisions(reader, robots, missed)
    for stamp, found in groupby(answers, lambda answer: answer.decision.stamp_ns):
        first_ns = stamp if first_ns is None else first_ns
        for answer in sorted(found, key=lambda answer: robots.index(answer.robot)):
            yield _row(answer, first_ns)


def _row(answer: RecordedDecision, first_ns: int) -> Row:
    found = answer.decision
    goal = found.goal or (None, None)
    return {
        **({} if answer.robot == NO_NAMESPACE else {"robot": answer.robot}),
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
        **{f"range_{k}": r for k, r in enumerate(answer.sectors.ranges, start=1)},
    }
