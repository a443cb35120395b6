# SPDX-License-Identifier: Apache-2.0
"""Recovery while every gap is closed: wait, back off, replan, give up. Not in the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from ..core.geometry import wrap_angle
from ..core.option_specs import check, option
from ..core.planner_types import Ranges

SECOND_NS = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveryParams:
    """Parameters of the recovery; off by default: a blocked robot stops and waits."""

    enabled: bool = option(False, "while every gap is closed: wait, back off, replan, give up")
    wait_s: float = option(
        2.0,
        "waiting time for a gap; a gap open for as long ends the recovery",
        unit="s",
        minimum=0.0,
        maximum=600.0,
    )
    back_off_s: float = option(
        1.0,
        "then move for this time to the side with the most room",
        unit="s",
        minimum=0.0,
        maximum=60.0,
    )
    back_off_mps: float = option(
        0.2, "speed while backing off", unit="m/s", minimum=0.0, maximum=100.0
    )
    attempts: int = option(3, "how often to back off before giving up", minimum=0, maximum=1000)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class Phase(Enum):
    """Phase of the recovery."""

    FREE = "free"
    WAIT = "wait"
    BACK_OFF = "back_off"
    REPLAN = "replan"
    GIVEN_UP = "given_up"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """State: phase, start of its time, time when the last gap opened, attempts so far."""

    phase: Phase = Phase.FREE
    since_ns: int = 0
    free_ns: int = 0
    attempt: int = 0


def advance(state: Recovery, blocked: bool, now_ns: int, params: RecoveryParams) -> Recovery:
    """Next state: a pure function, called once per tick with whether every gap is closed.

    A gap open for less than wait_s does not restart the wait, so that a flickering gap cannot
    delay giving up for ever. Only a new trip ends GIVEN_UP.
    """
    phase = state.phase
    if phase is Phase.GIVEN_UP:
        return state
    if phase is Phase.FREE:
        return _while_free(state, blocked, now_ns, params)
    if phase is Phase.WAIT:
        if not blocked:
            return _changed(state, Phase.FREE, state.since_ns, free_ns=now_ns)
        if not _passed(state.since_ns, now_ns, params.wait_s):
            return state
        if state.attempt >= params.attempts:
            return _changed(state, Phase.GIVEN_UP, now_ns)
        return _changed(state, Phase.BACK_OFF, now_ns, attempt=state.attempt + 1)
    if phase is Phase.BACK_OFF:
        over = _passed(state.since_ns, now_ns, params.back_off_s)
        return _changed(state, Phase.REPLAN, now_ns) if over else state
    following = Phase.WAIT if blocked else Phase.FREE
    return _changed(state, following, now_ns, free_ns=now_ns)


def wait_after(tries: int, now_ns: int) -> Recovery:
    """Begin to wait, as for a gap, of a robot that has been free that many times in vain."""
    return Recovery(phase=Phase.WAIT, since_ns=now_ns, attempt=tries)


def _while_free(state: Recovery, blocked: bool, now_ns: int, params: RecoveryParams) -> Recovery:
    over = _passed(state.free_ns, now_ns, params.wait_s)
    if blocked:
        restarted = over or not state.since_ns
        since_ns, attempt = (now_ns, 0) if restarted else (state.since_ns, state.attempt)
        waiting = _changed(state, Phase.WAIT, since_ns, attempt=attempt)
        return advance(waiting, True, now_ns, params)  # the wait may be over already
    return Recovery() if over else state


def _changed(
    state: Recovery,
    phase: Phase,
    since_ns: int,
    *,
    free_ns: int | None = None,
    attempt: int | None = None,
) -> Recovery:
    return Recovery(
        phase=phase,
        since_ns=since_ns,
        free_ns=state.free_ns if free_ns is None else free_ns,
        attempt=state.attempt if attempt is None else attempt,
    )


def _passed(since_ns: int, now_ns: int, duration_s: float) -> bool:
    return now_ns - since_ns >= duration_s * SECOND_NS


def longest_s(params: RecoveryParams, tick_s: float) -> float:
    """Upper bound of the time from the first closed tick to GIVEN_UP, in s.

    It holds if no gap stays open for wait_s: each attempt includes a wait, which an open gap may
    prolong by almost wait_s, and each phase ends at a tick.
    """
    waits, n = params.attempts + 1, params.attempts
    return waits * (2.0 * params.wait_s + 3.0 * tick_s) + n * (params.back_off_s + 2.0 * tick_s)


def most_room(ranges_m: Ranges, preferred_rad: float) -> tuple[float, float]:
    """(heading in rad, room in m) of the most room; of equals the one nearest to preferred_rad.

    The headings are the middles of the sectors. The room is the distance to the nearest tangent
    line of the enlarged obstacles in all sectors less than 90 degrees off: a shorter move touches
    no obstacle at rest. inf without obstacles.
    """
    n = len(ranges_m)
    width = 2.0 * math.pi / n
    best = (-1.0, -math.inf, 0.0)
    for i in range(n):
        heading = (i + 0.5) * width
        room = math.inf
        for j, r in enumerate(ranges_m):
            off = max(0.0, abs(wrap_angle((j - i) * width)) - 0.5 * width)
            if off < 0.5 * math.pi:
                room = min(room, r / math.cos(off))
        nearness = -round(abs(wrap_angle(heading - preferred_rad)), 9)
        best = max(best, (room, nearness, -heading))
    return wrap_angle(-best[2]), best[0]
