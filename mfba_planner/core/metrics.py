# SPDX-License-Identifier: Apache-2.0
"""What a run was worth: each figure defined once, computed from an Episode and nothing else."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from .episode import Episode, Outcome
from .geometry import distance
from .planner import NANO, Decision, Mode
from .world import step_clearances

CONTACT_SLACK_M = 1e-9  # rounding of a tangential pass is not a collision


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Figures of one run; lengths in metres, times in simulated seconds."""

    outcome: Outcome
    success: bool
    length_m: float
    time_s: float
    ticks: int
    fitness: float
    min_clearance_m: float
    collisions: int
    mode_switches: int
    avoidance_ticks: int
    blocked_ticks: int
    stopped_ticks: int
    encounters: tuple[int, ...]


def evaluate(episode: Episode) -> Result:
    """Compute the Result of an episode.

    length_m is the sum of eq. 1 over all steps and fitness its reciprocal, as Tables 5 and 7
    use it (no epsilon; inf for a robot that never moved). min_clearance_m is the smallest
    gap between robot and obstacle edges, continuous in time, negative in contact (inf without
    obstacles); collisions counts contacts, one per obstacle and unbroken run of ticks.
    encounters lists, in order of time, the obstacles (from 1) that came within SR of the
    enlarged edge at some tick. mode_switches counts every change of mode, the one to ARRIVED
    included. success is: goal reached, no collision.
    """
    clearances = tick_clearances(episode)
    # fsum: sum() itself rounds differently before and after Python 3.12
    length = math.fsum(
        distance(a.pose.position, b.pose.position) for a, b in pairwise(episode.ticks)
    )
    modes = [tick.mode for tick in episode.ticks]
    stamps = [tick.stamp_ns for tick in episode.ticks] or [0]
    collisions = _contacts(clearances)
    return Result(
        outcome=episode.outcome,
        success=episode.outcome is Outcome.GOAL_REACHED and collisions == 0,
        length_m=length,
        time_s=(stamps[-1] - stamps[0]) * NANO,
        ticks=len(episode.ticks),
        fitness=1.0 / length if length > 0.0 else math.inf,
        min_clearance_m=min((min(row) for row in clearances if row), default=math.inf),
        collisions=collisions,
        mode_switches=sum(a is not b for a, b in pairwise(modes)),
        avoidance_ticks=modes.count(Mode.OBSTACLE_AVOIDANCE),
        blocked_ticks=modes.count(Mode.BLOCKED),
        stopped_ticks=modes.count(Mode.STOPPED),
        encounters=encounters(episode),
    )


def tick_clearances(episode: Episode) -> list[list[float]]:
    """Smallest gap (m) to each obstacle during each step; ticks - 1 rows (one if no step)."""
    ticks = episode.ticks
    if len(ticks) == 1:
        ticks = (ticks[0], ticks[0])
    return [
        step_clearances(
            episode.scenario,
            episode.time_s(a.stamp_ns),
            episode.time_s(b.stamp_ns),
            a.pose.position,
            b.pose.position,
        )
        for a, b in pairwise(ticks)
    ]


def _contacts(clearances: list[list[float]]) -> int:
    count = 0
    for column in zip(*clearances):
        touching = [gap < -CONTACT_SLACK_M for gap in column]
        count += sum(now and not before for before, now in pairwise([False, *touching]))
    return count


def encounters(episode: Episode) -> tuple[int, ...]:
    """Obstacles (from 1) whose enlarged edge came within SR, in order of first encounter."""
    met: dict[int, None] = {}
    for tick in episode.ticks:
        met.update(dict.fromkeys(within_range(episode, tick)))
    return tuple(met)


def within_range(episode: Episode, tick: Decision) -> tuple[int, ...]:
    """Obstacles (from 1) whose enlarged edge is within SR at a tick."""
    circles = episode.scenario.enlarged(episode.time_s(tick.stamp_ns))
    return tuple(
        number
        for number, (center, radius) in enumerate(circles, start=1)
        if distance(tick.pose.position, center) - radius <= episode.sensor.sensing_range_m
    )
