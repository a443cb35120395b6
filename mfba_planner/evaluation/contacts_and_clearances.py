# SPDX-License-Identifier: Apache-2.0
"""Contacts, clearances, time to collision and smoothness of a run, computed as a stream."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point, bearing, distance, wrap_angle
from ..simulation.batched_motion import Array, StepClearances

CONTACT_SLACK_M = 1e-9  # rounding of a tangential pass is not a collision
WALL = -1  # first_contact_with of a wall segment; all of them count as one
STANDSTILL_M = 1e-9  # of a step: shorter ones are rounding
HEADING_CHANGE_RAD = math.radians(15.0)  # half a sector of Fig. 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RunMotion:
    """Figures of one run beyond evaluation.metrics.Result, over all K steps.

    hits_moving, hits_standing: the collisions of Result, by whether the robot moved (more than
        STANDSTILL_M) in the step in which the contact started: the robot hit the obstacle, or
        the obstacle hit the standing robot.
    first_contact_with, first_contact_s: the obstacle (from 1; 0 for none, WALL for a wall) of the
        first contact, and the start time of the step in which it occurs (inf for none).
    mean_clearance_m: (1/K) sum_k min_i gap_ki, the smallest gap of each step on average, walls
        among them; inf without obstacles and walls.
    min_ttc_s: time to collision, min over k and i of the time until contact if robot and
        obstacle both keep their velocity of step k; 0 in contact, inf if never.
    turning_rad: sum_k |h_(k+1) - h_k| over the headings h of all steps longer than STANDSTILL_M.
    curvature_radpm: turning_rad / length, the path's mean absolute curvature; 0 without a step.
    heading_changes: how many of these turns are larger than HEADING_CHANGE_RAD.
    jerk_mps3: mean over k of |p_(k+3) - 3 p_(k+2) + 3 p_(k+1) - p_k| / dt^3, dt one tick; it
        compares runs of equal ticks only. 0 with fewer than three steps.
    avoidance_s: time in obstacle avoidance, avoidance_ticks * dt.
    """

    hits_moving: int
    hits_standing: int
    first_contact_with: int
    first_contact_s: float
    mean_clearance_m: float
    min_ttc_s: float
    turning_rad: float
    curvature_radpm: float
    heading_changes: int
    jerk_mps3: float
    avoidance_s: float


class DrivenPath:
    """Turning, heading changes and jerk of a path, added point by point."""

    def __init__(self) -> None:
        """Start before the first point."""
        self._last: list[Point] = []
        self._heading: float | None = None
        self._turns = array("d")
        self._thirds_m = 0.0
        self._third_count = 0
        self.heading_changes = 0

    def add(self, points: Sequence[Point]) -> None:
        """Add the next points, at least one."""
        whole = [*self._last, *points]
        first = max(0, len(self._last) - 1)
        for a, b in zip(whole[first:], whole[first + 1 :]):
            if distance(a, b) > STANDSTILL_M:
                heading = bearing(a, b)
                if self._heading is not None:
                    turn = abs(wrap_angle(heading - self._heading))
                    self._turns.append(turn)
                    self.heading_changes += turn > HEADING_CHANGE_RAD
                self._heading = heading
        if len(whole) > 3:
            x, y = np.diff(np.array(whole), n=3, axis=0).T
            self._thirds_m += math.fsum(np.sqrt(x * x + y * y).tolist())
            self._third_count += len(x)
        self._last = whole[-3:]

    def interrupt(self) -> None:
        """Start a new path: no turn and no jerk between the last and the next point."""
        self._last, self._heading = [], None

    @property
    def turning_rad(self) -> float:
        """Sum of all turns so far."""
        return math.fsum(self._turns)

    def jerk(self, tick_s: float) -> float:
        """Mean jerk so far, m/s^3."""
        return self._thirds_m / self._third_count / tick_s**3 if self._third_count else 0.0


class ObstaclePasses:
    """Contacts, gaps and times to collision of a run, added step by step."""

    def __init__(self) -> None:
        """Start before the first step."""
        self.min_gap_m = self.min_ttc_s = self.first_contact_s = math.inf
        self.hits_moving = self.hits_standing = self.first_contact_with = 0
        self._gaps_m = 0.0
        self._count = 0
        self._wall: int | None = None  # column of the walls
        self._touching: Array | None = None

    def add(self, steps: StepClearances, times_s: Array, moved_m: Array) -> None:
        """Add K steps that start at times_s (K,) and move the robot by moved_m (K,)."""
        gap_m, contact_s = steps.gaps_with_walls_m, steps.contact_s
        if steps.walls is not None:
            contact_s = np.column_stack([contact_s, steps.walls.contact_s])
        if not gap_m.size:
            return
        self._wall = None if steps.walls is None else gap_m.shape[1] - 1
        nearest = gap_m.min(axis=1)
        self.min_gap_m = min(self.min_gap_m, float(nearest.min()))
        self.min_ttc_s = min(self.min_ttc_s, float(contact_s.min()))
        self._gaps_m += math.fsum(nearest.tolist())
        self._count += len(nearest)
        touching = gap_m < -CONTACT_SLACK_M
        if self._touching is not None or touching.any():
            self._count_contacts(touching, times_s, moved_m)
        self._touching = touching[-1] if touching[-1].any() else None

    def _count_contacts(self, touching: Array, times_s: Array, moved_m: Array) -> None:
        """Count the contacts that start in these steps."""
        before = np.zeros_like(touching)
        before[1:] = touching[:-1]
        if self._touching is not None:
            before[0] = self._touching
        for k, i in np.argwhere(touching & ~before).tolist():
            if moved_m[k] > STANDSTILL_M:
                self.hits_moving += 1
            else:
                self.hits_standing += 1
            if not self.first_contact_with:
                self.first_contact_with = WALL if i == self._wall else i + 1
                self.first_contact_s = float(times_s[k])

    @property
    def mean_gap_m(self) -> float:
        """Mean over the steps of the smallest gap; inf without any."""
        return self._gaps_m / self._count if self._count else math.inf
