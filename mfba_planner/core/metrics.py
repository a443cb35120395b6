# SPDX-License-Identifier: Apache-2.0
"""What a run was worth: each figure defined once, computed from an Episode and nothing else."""

from __future__ import annotations

import math
from array import array
from collections import Counter
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
    tally = Tally(episode)
    for tick in episode.ticks:
        tally.add(tick)
    return tally.result(episode.outcome)


class Tally:
    """The figures of evaluate(), tick by tick: holds one tick, however long the run is."""

    def __init__(self, run: Episode) -> None:
        """Start before the first tick; of run, only what was run counts, not its ticks."""
        self._run = run
        self._first: Decision | None = None
        self._last: Decision | None = None
        # fsum of all at the end: sum() itself rounds differently before and after Python 3.12
        self._steps_m = array("d")
        self._modes: Counter[Mode] = Counter()
        self._switches = self._collisions = 0
        self._min_clearance_m = math.inf
        self._touching: list[bool] = []
        self._encounters: dict[int, None] = {}

    def add(self, tick: Decision) -> None:
        """Take the next tick."""
        before = self._last
        if before is None:
            self._first = tick
        else:
            self._steps_m.append(distance(before.pose.position, tick.pose.position))
            self._switches += before.mode is not tick.mode
            self._pass(before, tick)
        self._last = tick
        self._modes[tick.mode] += 1
        self._encounters.update(dict.fromkeys(within_range(self._run, tick)))

    def result(self, outcome: Outcome) -> Result:
        """The figures of the ticks so far; a single tick has the clearance of standing there."""
        first, last = self._first, self._last
        if first is not None and first is last:
            self._pass(first, first)
        length = math.fsum(self._steps_m)
        return Result(
            outcome=outcome,
            success=outcome is Outcome.GOAL_REACHED and self._collisions == 0,
            length_m=length,
            time_s=(last.stamp_ns - first.stamp_ns) * NANO if first and last else 0.0,
            ticks=self._modes.total(),
            fitness=1.0 / length if length > 0.0 else math.inf,
            min_clearance_m=self._min_clearance_m,
            collisions=self._collisions,
            mode_switches=self._switches,
            avoidance_ticks=self._modes[Mode.OBSTACLE_AVOIDANCE],
            blocked_ticks=self._modes[Mode.BLOCKED],
            stopped_ticks=self._modes[Mode.STOPPED],
            encounters=tuple(self._encounters),
        )

    def _pass(self, before: Decision, tick: Decision) -> None:
        """The obstacles during one step; a contact counts when it begins."""
        gaps = _clearances(self._run, before, tick)
        self._min_clearance_m = min([self._min_clearance_m, *gaps])
        touching = [gap < -CONTACT_SLACK_M for gap in gaps]
        were = self._touching or [False] * len(gaps)
        self._collisions += sum(now and not was for was, now in zip(were, touching))
        self._touching = touching


def tick_clearances(episode: Episode) -> list[list[float]]:
    """Smallest gap (m) to each obstacle during each step; ticks - 1 rows (one if no step)."""
    ticks = episode.ticks
    if len(ticks) == 1:
        ticks = (ticks[0], ticks[0])
    return [_clearances(episode, a, b) for a, b in pairwise(ticks)]


def _clearances(run: Episode, a: Decision, b: Decision) -> list[float]:
    times_s = run.time_s(a.stamp_ns), run.time_s(b.stamp_ns)
    return step_clearances(run.scenario, *times_s, a.pose.position, b.pose.position)


def within_range(episode: Episode, tick: Decision) -> tuple[int, ...]:
    """Obstacles (from 1) whose enlarged edge is within SR at a tick."""
    circles = episode.scenario.enlarged(episode.time_s(tick.stamp_ns))
    return tuple(
        number
        for number, (center, radius) in enumerate(circles, start=1)
        if distance(tick.pose.position, center) - radius <= episode.sensor.sensing_range_m
    )
