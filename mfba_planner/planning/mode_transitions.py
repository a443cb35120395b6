# SPDX-License-Identifier: Apache-2.0
"""State machine of the planner modes: events and transitions (Algorithm 1)."""

from __future__ import annotations

from enum import Enum

from ..core.planner_types import Mode


class Event(Enum):
    """What the observation of a tick amounts to; one event per tick."""

    NO_GOAL = "no_goal"
    NEW_GOAL = "new_goal"
    INVALID = "invalid"
    STALE = "stale"
    AT_GOAL = "at_goal"
    CLEAR = "clear"
    OBSTACLE = "obstacle"
    NO_GAP = "no_gap"


_NEXT = {
    Event.NO_GOAL: Mode.IDLE,
    Event.NEW_GOAL: Mode.IDLE,
    Event.INVALID: Mode.STOPPED,
    Event.STALE: Mode.STOPPED,
    Event.AT_GOAL: Mode.ARRIVED,
    Event.CLEAR: Mode.PATH_GENERATION,
    Event.OBSTACLE: Mode.OBSTACLE_AVOIDANCE,
    Event.NO_GAP: Mode.BLOCKED,
}


def transition(mode: Mode, event: Event) -> Mode:
    """Next mode. It depends on the event only, except that ARRIVED is final.

    Only a new or a withdrawn goal ends ARRIVED: there the paper's while loop is over.
    """
    if mode is Mode.ARRIVED and event not in (Event.NEW_GOAL, Event.NO_GOAL):
        return Mode.ARRIVED
    return _NEXT[event]
