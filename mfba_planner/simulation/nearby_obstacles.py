# SPDX-License-Identifier: Apache-2.0
"""Which obstacles may be near the robot: preselected for many ticks ahead, for speed."""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, distance
from ..core.planner_types import NANO
from .batched_motion import Array, Motion

AHEAD_TICKS = 64  # whose centres are computed at once; the paper's trip of 17 m has 57
PICKED_TICKS = 24  # of these, for which near obstacles are preselected at once
FEW = 16  # obstacles: up to so many all count as near, which is cheaper than a test
ROAM_M = 2.0  # least distance the robot may move before they are selected again

Nearby = tuple[list[int], list[tuple[Point, float]]]


class NearbyObstacles:
    """Preselects the obstacles near the robot, as most are far away most of the time."""

    def __init__(self, motion: Motion, tick_ns: int) -> None:
        """Start without a selection; tick k is at time k tick_ns."""
        self._motion, self._tick_ns = motion, tick_ns
        self._centers = np.zeros((2, 0, 0))
        self._centers_from = 0
        self._which: list[int] = []
        self._radii: list[float] = []
        self._xs: list[list[float]] = []  # of the selected, a row per tick
        self._ys: list[list[float]] = []
        self._picked_from = 0
        self._picked_at: Point = (math.nan, math.nan)
        self._reach_m, self._roam_m = math.nan, ROAM_M

    def at(self, tick: int, position: Point, reach_m: float) -> Nearby:
        """Indices, and (centre, enlarged radius), of all obstacles whose edge is within reach.

        Ascending indices. May hold others too; none is missing, but those that are absent. A
        position that is not finite counts as near to all.
        """
        k = tick - self._picked_from
        dx, dy = position[0] - self._picked_at[0], position[1] - self._picked_at[1]
        if not (
            0 <= k < len(self._xs)
            and dx * dx + dy * dy <= self._roam_m * self._roam_m
            and reach_m == self._reach_m
        ):
            self._pick(tick, position, reach_m)
            k = 0
        circles = list(zip(zip(self._xs[k], self._ys[k]), self._radii))
        if not self._motion.has_absent:
            return self._which, circles
        kept = [n for n, (center, _) in enumerate(circles) if not math.isnan(center[0])]
        return [self._which[n] for n in kept], [circles[n] for n in kept]

    def _pick(self, tick: int, position: Point, reach_m: float) -> None:
        k = tick - self._centers_from
        if not 0 <= k < self._centers.shape[1]:
            times_s = np.arange(tick, tick + AHEAD_TICKS) * self._tick_ns * NANO
            self._centers, self._centers_from, k = self._motion.centers(times_s), tick, 0
        count = len(self._motion.radius_m)
        if count <= FEW:
            centers, which, self._roam_m = self._centers[:, k:], np.arange(count), math.inf
        else:
            centers = self._centers[:, k : k + PICKED_TICKS]
            which = self._near(centers, tick, position, reach_m)
        self._xs, self._ys = centers[:, :, which].tolist()
        self._which, self._radii = which.tolist(), self._motion.radius_m[which].tolist()
        self._picked_from, self._picked_at, self._reach_m = tick, position, reach_m

    def _near(self, centers: Array, tick: int, position: Point, reach_m: float) -> Array:
        """Indices of the obstacles in reach of any point the robot may roam to meanwhile."""
        # As far as it moved last time: a fast robot would need a new selection at every tick.
        per_tick = distance(self._picked_at, position) / max(1, abs(tick - self._picked_from))
        roam_m = 1.1 * PICKED_TICKS * per_tick
        self._roam_m = roam_m if ROAM_M < roam_m < math.inf else ROAM_M
        with np.errstate(invalid="ignore", over="ignore"):
            dx, dy = centers[0] - position[0], centers[1] - position[1]
            squares = dx * dx + dy * dy
            gone = np.isnan(centers[0])
            square = np.where(gone, np.inf, squares).min(axis=0) if gone.any() else squares.min(0)
            far = self._motion.radius_m + (reach_m + self._roam_m + 1e-6)
            away = np.isfinite(square) & (square > far * far)
        return np.flatnonzero(~(away | gone.all(axis=0)))
