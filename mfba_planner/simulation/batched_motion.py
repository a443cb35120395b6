# SPDX-License-Identifier: Apache-2.0
"""All obstacles of a scenario at many times at once: obstacle_motion.py on arrays, same bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..core.geometry import Point
from .contact import clearance
from .obstacle_motion import Obstacle, Walls, stretches_of
from .recorded_motion import ALWAYS, presence, slope
from .scenario import Scenario
from .wall_contact import WallClearances, wall_clearances

Array = np.ndarray
Row = tuple[float, Point, Point]  # a stretch: since when (s), its centre (m), its velocity (m/s)


@dataclass(frozen=True, slots=True)
class StepClearances:
    """K robot steps among N obstacles.

    gap_m (K, N): smallest distance between robot and obstacle edges during a step, as in
    step_clearances. contact_s (K, N): time from the start of the step to contact if both keep
    the velocity of that step; 0 in contact, inf for never. distance_m (K + 1, N): distance
    between the centres before each step and after the last. Of an obstacle that is absent all
    are inf. walls: the same two of the nearest wall segment; None for a scenario without any.
    """

    gap_m: Array
    contact_s: Array
    distance_m: Array
    walls: WallClearances | None = None

    @property
    def gaps_with_walls_m(self) -> Array:
        """gap_m, and with wall segments a last column, that of the nearest of them."""
        return (
            self.gap_m if self.walls is None else np.column_stack([self.gap_m, self.walls.gap_m])
        )


class Motion:
    """The motion of all obstacles of one scenario, evaluated at many times."""

    def __init__(self, scenario: Scenario, radius_m: float | None = None) -> None:
        """Build the arrays once: a row for each stretch between two turns.

        radius_m is that of the disc among them; None: robot_radius_m.
        """
        self._scenario = scenario
        self._disc_m = scenario.robot_radius_m if radius_m is None else radius_m
        obstacles, walls = scenario.obstacles, scenario.walls
        self.radius_m = np.array([o.radius_m + self._disc_m for o in obstacles])
        stretches = [_rows_of(obstacle, walls) for obstacle in obstacles]
        rows = [row for stretch in stretches for row in stretch]
        self._since = np.array([since_s for since_s, _, _ in rows])
        self._center = _pairs([center for _, center, _ in rows])
        self._velocity = _pairs([velocity for _, _, velocity in rows])
        counts = [len(stretch) for stretch in stretches]
        self._first = np.cumsum([0, *counts[:-1]]) if counts else np.zeros(0, dtype=np.int64)
        self._turning = [(i, [row[0] for row in s[1:]]) for i, s in enumerate(stretches)]
        self._turning = [(i, since) for i, since in self._turning if since]
        self._loops = [
            (i, o.trajectory[0][0], o.trajectory[-1][0], o.stays)
            for i, o in enumerate(obstacles)
            if o.loop
        ]
        limits = [(i, *presence(o)) for i, o in enumerate(obstacles)]
        self._limits = [limit for limit in limits if limit[1:] != ALWAYS]
        self._box: tuple[Array, Array] | None = None
        if walls is not None:
            radius = np.array([o.radius_m for o in obstacles])
            low = np.array(walls.lower_m)[:, None, None] + radius
            high = np.array(walls.upper_m)[:, None, None] - radius
            free = [i for i, o in enumerate(obstacles) if o.trajectory]
            low[..., free], high[..., free] = -np.inf, np.inf
            self._box = low, high

    def centers(self, times_s: Array) -> Array:
        """Centres (2, K, N) in metres at times (K,), bit for bit those of Scenario.centers."""
        centers = self._folded(self._unfolded(times_s, self._rows(times_s)))
        return self._without_absent(centers, times_s)

    @property
    def has_absent(self) -> bool:
        """Whether an obstacle is absent at some time; then centers() may hold NaN."""
        return bool(self._limits)

    def _without_absent(self, centers: Array, times_s: Array) -> Array:
        for i, begin, end in self._limits:
            centers[:, (times_s < begin) | (times_s > end), i] = np.nan
        return centers

    def steps(self, times_s: Array, positions_m: Array) -> StepClearances:
        """Steps of a robot at positions (2, K + 1) at times (K + 1,), uniform between them."""
        rows = self._rows(times_s)
        unfolded = self._unfolded(times_s, rows)
        centers = self._without_absent(self._folded(unfolded), times_s)
        start, end = positions_m[:, :-1, None], positions_m[:, 1:, None]
        p = centers[:, :-1] - start  # from the robot to the obstacle
        q = centers[:, 1:] - (start + (end - start)) - p
        square = q[0] * q[0] + q[1] * q[1]
        along = p[0] * q[0] + p[1] * q[1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            s = np.where(square == 0.0, 0.0, -along / square)
            s = np.minimum(1.0, np.where(s > 0.0, s, 0.0))
            d = p + s * q
            nearest = np.sqrt(d[0] * d[0] + d[1] * d[1])
            dx, dy = centers - positions_m[:, :, None]
            distance = np.sqrt(dx * dx + dy * dy)
            contact = self._contact(square, along, distance[:-1], np.diff(times_s)[:, None])
        broken = self._broken(times_s)
        if broken is not None:  # no motion of that step: it is elsewhere, or gone, at its end
            contact[broken] = np.inf
            distance[np.isnan(centers[0])] = np.inf
        # A pose that is not finite was refused and has no gap.
        gap = np.where(np.isnan(nearest), np.inf, nearest) - self.radius_m
        kinks = self._may_kink(unfolded, rows, times_s)
        for k, i in np.argwhere(kinks if broken is None else kinks | broken).tolist():
            (x0, x1), (y0, y1) = positions_m[:, k : k + 2].tolist()
            t0, t1 = times_s[k : k + 2].tolist()
            obstacle = self._scenario.obstacles[i]
            gap[k, i] = clearance(
                self._scenario, obstacle, t0, t1, (x0, y0), (x1, y1), self._disc_m
            )
        return StepClearances(gap, contact, distance, self._walls(times_s, positions_m))

    def _walls(self, times_s: Array, positions_m: Array) -> WallClearances | None:
        scenario = self._scenario
        if not scenario.segments_m:
            return None
        return wall_clearances(scenario.segments, self._disc_m, np.diff(times_s), positions_m)

    def _rows(self, times_s: Array, side: Literal["left", "right"] = "right") -> Array:
        """Row number of each obstacle's stretch at each time, (K, N) or (1, N).

        At the time of a turn it is the later stretch; with side="left", the earlier one.
        """
        if not self._turning:
            return self._first[None, :]
        rows = np.repeat(self._first[None, :], len(times_s), axis=0)
        times = self._lap_times(times_s)
        for i, since_s in self._turning:
            own = times[:, i] if self._loops else times_s
            rows[:, i] += np.searchsorted(since_s, own, side=side)
        return rows

    def _lap_times(self, times_s: Array) -> Array:
        """Times for each obstacle, (K, 1) or (K, N); of loops, brought into their first lap."""
        times = times_s[:, None]
        if self._loops:
            times = np.repeat(times, len(self.radius_m), axis=1)
        for i, first, last, stays in self._loops:
            laps = np.floor((times_s - first) / (last - first))
            own = np.clip(times_s - laps * (last - first), first, last)
            times[:, i] = np.where(times_s < first, times_s, own) if stays else own
        return times

    def _broken(self, times_s: Array) -> Array | None:
        """Which obstacles appear, vanish or begin a lap between two times, (K, N); None: none."""
        if not (self._loops or self._limits):
            return None
        broken = np.zeros((len(times_s) - 1, len(self.radius_m)), dtype=bool)
        for i, first, last, stays in self._loops:
            laps = np.floor((times_s - first) / (last - first))
            broken[:, i] |= np.diff(np.maximum(laps, 0.0) if stays else laps) != 0.0
        for i, *ends in self._limits:
            for end in ends:
                broken[:, i] |= (times_s[:-1] <= end) & (end <= times_s[1:])
        return broken

    def _unfolded(self, times_s: Array, rows: Array) -> Array:
        """Centres as if there were no walls, (2, K, N)."""
        times = self._lap_times(times_s) - self._since[rows]
        return self._center[:, rows] + self._velocity[:, rows] * times

    def _folded(self, x: Array) -> Array:
        """Reflect unbounded coordinates (2, K, N) into the walls, as obstacle_motion does."""
        if self._box is None:
            return x
        low, high = self._box
        length = high - low
        with np.errstate(invalid="ignore"):  # no room between the walls, or none: handled below
            offset = np.fmod(x - low, 2.0 * length)
        offset = np.where(offset < 0.0, offset + 2.0 * length, offset)
        folded = np.minimum(high, low + np.where(offset <= length, offset, 2.0 * length - offset))
        folded = np.where(length <= 0.0, low, folded)
        return np.where((low <= x) & (x <= high), x, folded)

    def _may_kink(self, unfolded: Array, rows: Array, times_s: Array) -> Array:
        """Which obstacles may meet a wall or turn between two successive times, (K, N)."""
        kinks = np.zeros((unfolded.shape[1] - 1, unfolded.shape[2]), dtype=bool)
        if len(rows) > 1:
            # Without walls a turn at the end of a step is not within it.
            ends = rows if self._box is not None else self._rows(times_s, "left")
            kinks |= rows[:-1] != ends[1:]
        if self._box is not None:
            low, high = self._box
            with np.errstate(divide="ignore", invalid="ignore"):
                u = (unfolded - low) / (high - low)
            u0, u1 = np.minimum(u[:, :-1], u[:, 1:]), np.maximum(u[:, :-1], u[:, 1:])
            kinks |= np.any(np.ceil(u0) <= np.floor(u1), axis=0)
        return kinks

    def _contact(self, square: Array, along: Array, distance: Array, duration_s: Array) -> Array:
        """Seconds until |p + s q| is the enlarged radius; 0 inside, inf for never."""
        excess = distance * distance - self.radius_m * self.radius_m
        root = along * along - square * excess
        s = (-along - np.sqrt(root)) / square
        comes = (along < 0.0) & (root >= 0.0)
        return np.where(excess < 0.0, 0.0, np.where(comes, s * duration_s, np.inf))


def _rows_of(obstacle: Obstacle, walls: Walls | None) -> list[Row]:
    """The stretches of an obstacle's motion; the first extends backwards, the last onwards."""
    knots = obstacle.trajectory
    if knots:
        first, last = knots[0], knots[-1]
        still = (0.0, 0.0)
        moving = [(t, (x, y), slope(knots, k)) for k, (t, x, y) in enumerate(knots[:-1])]
        return [(first[0] - 1.0, first[1:], still), *moving, (last[0], last[1:], still)]
    stretches = stretches_of(obstacle, walls) if obstacle.turns else ((0.0, obstacle),)
    return [(since_s, plain.center_m, plain.velocity) for since_s, plain in stretches]


def _pairs(rows: list[tuple[float, float]]) -> Array:
    return np.array(rows, dtype=float).reshape(-1, 2).T
