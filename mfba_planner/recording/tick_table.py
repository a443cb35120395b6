# SPDX-License-Identifier: Apache-2.0
"""A bag as a table of ticks: one row per decision, streamed; for `mfba export`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from ..core.planner_types import NANO
from ..perception.sensory_vector import bits_text
from .bag_reader import BagReader
from .decisions_with_sectors import RecordedDecision, rising_decisions
from .fleet_topics import NO_NAMESPACE

Row = dict[str, Any]

# name: (type, meaning); the ranges of the sectors follow as range_1, range_2, ...
COLUMNS: dict[str, tuple[type, str]] = {
    "robot": (str, "name of the robot; only for fleets"),
    "stamp_ns": (int, "stamp of the tick, ns"),
    "time_s": (float, "time since the first row's stamp, s"),
    "mode": (str, "mode of the planner"),
    "reason": (str, "reason for the decision"),
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


def read_rows(reader: BagReader, robots: Sequence[str], omitted: dict[str, str]) -> Iterator[Row]:
    """Yield the rows sorted by stamp, then in the sequence of `robots`.

    Omits decisions and raises BagError as rising_decisions().
    """
    first_ns: int | None = None
    decisions = rising_decisions(reader, robots, omitted)
    for stamp, group in groupby(decisions, lambda recorded: recorded.decision.stamp_ns):
        first_ns = stamp if first_ns is None else first_ns
        for recorded in sorted(group, key=lambda recorded: robots.index(recorded.robot)):
            yield _row(recorded, first_ns)


def _row(recorded: RecordedDecision, first_ns: int) -> Row:
    decision = recorded.decision
    goal = decision.goal or (None, None)
    return {
        **({} if recorded.robot == NO_NAMESPACE else {"robot": recorded.robot}),
        "stamp_ns": decision.stamp_ns,
        "time_s": (decision.stamp_ns - first_ns) * NANO,
        "mode": decision.mode.value,
        "reason": decision.reason,
        **dict(zip(("x", "y", "yaw"), decision.pose)),
        "goal_x": goal[0],
        "goal_y": goal[1],
        **dict(zip(("waypoint_x", "waypoint_y"), decision.waypoint)),
        **dict(zip(("velocity_x", "velocity_y"), decision.velocity)),
        "gap": decision.gap,
        "vs": bits_text(decision.vs),
        "vg": bits_text(decision.vg),
        **{f"range_{k}": r for k, r in enumerate(recorded.sectors.ranges, start=1)},
    }
