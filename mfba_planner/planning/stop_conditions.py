# SPDX-License-Identifier: Apache-2.0
"""Stop conditions of every planner: refused or stale input, no goal, goal reached."""

from __future__ import annotations

import math

from ..core.geometry import distance
from ..core.planner_types import NANO, Observation
from .mode_transitions import Event
from .planner_params import PlannerParams


def reason_to_stop(
    obs: Observation, params: PlannerParams, *, sectors: bool = True
) -> tuple[Event, str] | None:
    """The stop condition that holds and its reason, or None; sectors=False: sectors unused."""
    refused = obs.refused or _fault(obs, sectors)
    if refused:
        return Event.INVALID, f"refused input: {refused}"
    age_s = (obs.now_ns - obs.stamp_ns) * NANO
    if age_s > params.input_timeout_s:
        return Event.STALE, f"input is {age_s:.3f} s old"
    if obs.goal is None:
        return Event.NO_GOAL, "no goal given"
    if distance(obs.pose.position, obs.goal) <= params.goal_tolerance_m:
        return Event.AT_GOAL, "goal reached"
    return None


def _fault(obs: Observation, sectors: bool) -> str:
    """Why the input must not move a robot, "" if it is valid; the last check."""
    pose, goal, ranges = obs.pose, obs.goal or (0.0, 0.0), obs.ranges_m
    total, ring = sum(pose) + sum(goal), sum(ranges)
    finite = total - total == 0.0 and ring == ring  # False also if a sum overflows
    if finite and obs.stamp_ns >= 0 and (len(ranges) > 2 or not sectors):
        return ""  # the usual case, by one check
    for name, numbers in (("pose", obs.pose), ("goal", obs.goal or ())):
        if not all(map(math.isfinite, numbers)):
            return f"{name} {tuple(numbers)} is not finite"
    if sectors and len(obs.ranges_m) < 3:
        return f"{len(obs.ranges_m)} sectors are fewer than 3"
    if any(map(math.isnan, obs.ranges_m)):
        return "a sector's range is NaN"
    if obs.stamp_ns < 0:
        return f"stamp {obs.stamp_ns} ns is negative"
    return ""
