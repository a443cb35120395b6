# SPDX-License-Identifier: Apache-2.0
"""Refine a free path to a locally shortest one: shortcuts, then optimised via points (SLSQP)."""

from __future__ import annotations

import math

import numpy as np

from ...simulation.constant_velocity_segments import UniformSegments
from ...simulation.obstacle_motion import Walls
from .polyline import gaps, lengths, pair_gaps, path_gaps, within
from .static_walls import NO_WALLS, StaticWalls
from .tangent_search import CLEAR_M

_NEAR_M = 1.5  # obstacle segments further away are checked only in the end
_PAIR_M = 0.05  # pairs of segments closer than this are constraints
_BEND_RAD = 0.12  # a sharper bend becomes several: r a^3 / 12 longer than the arc
_DIFFERENCE_M = 1e-7
_MAX_POINTS = 40  # SLSQP's time grows with their cube; a path that has to wait has many


def refine(
    path: np.ndarray,
    speed_mps: float,
    segments: UniformSegments,
    inside: Walls | None = None,
    walls: StaticWalls = NO_WALLS,
) -> np.ndarray | None:
    """The shortest free polyline (p, 2) found near a path; None when the path is not free.

    The circles round the ends of walls, which are among the segments, hold it off the walls; the
    walls themselves are tested afterwards.
    """
    if not _free(path, speed_mps, segments, walls):
        return None
    best = _shortcut(path, speed_mps, segments, walls)
    for split in (False, True):
        trial = _bend_finer(best) if split else best
        if trial is None:
            break
        tight = _tighten(trial, speed_mps, segments, inside, walls)
        if tight is None:
            continue
        tight = _shortcut(tight, speed_mps, segments, walls)
        if lengths(tight[None])[0] < lengths(best[None])[0]:
            best = tight
    return best


def _free(
    points: np.ndarray, speed_mps: float, segments: UniformSegments, walls: StaticWalls
) -> bool:
    free = gaps(points[None], speed_mps, segments).min(initial=math.inf) >= 0.0
    return bool(free and walls.clear_path(points))


def _shortcut(
    points: np.ndarray, speed_mps: float, segments: UniformSegments, walls: StaticWalls
) -> np.ndarray:
    """Remove via points, the one that saves most first, while the path stays free."""
    while len(points) > 2:
        k = np.arange(1, len(points) - 1)
        trials = np.stack([np.delete(points, i, axis=0) for i in k])
        free = gaps(trials, speed_mps, segments).min(axis=(1, 2), initial=math.inf) >= 0.0
        free &= walls.clear(points[:-2], points[2:] - points[:-2], 0.0)  # past each via point
        if not free.any():
            return points
        new = np.where(free, lengths(trials), math.inf)
        points = trials[int(new.argmin())]
    return points


def _bend_finer(points: np.ndarray) -> np.ndarray | None:
    """Replace every sharp bend by three via points; None without one."""
    finer = [points[0]]
    for before, point, after in zip(points, points[1:], points[2:]):
        a, b = point - before, after - point
        la, lb = math.hypot(*a), math.hypot(*b)
        if la < 1e-6 or lb < 1e-6:
            finer.append(point)
            continue
        bend = abs(math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]))
        if bend < _BEND_RAD:
            finer.append(point)
            continue
        before_m = min(0.3 * bend, 0.4 * la)  # about half the arc round a circle of 0.6 m
        after_m = min(0.3 * bend, 0.4 * lb)
        finer += [point - a * (before_m / la), point, point + b * (after_m / lb)]
    finer.append(points[-1])
    return np.array(finer) if len(finer) > len(points) else None


def _tighten(
    points: np.ndarray,
    speed_mps: float,
    segments: UniformSegments,
    inside: Walls | None,
    walls: StaticWalls,
) -> np.ndarray | None:
    """Minimise the length over the via points (SLSQP); None when the result is not free."""
    if not 2 < len(points) <= _MAX_POINTS:
        return None
    near = gaps(points[None], speed_mps, segments)[0].min(axis=0) < _NEAR_M
    local = UniformSegments(*(column[near] for column in segments))
    pairs = gaps(points[None], speed_mps, local)[0] < _PAIR_M
    for margin in (CLEAR_M, 2.0 * CLEAR_M, 2e-4):
        problem = _Problem(points, speed_mps, local, pairs, margin)
        found = problem.solve(inside)
        gap = gaps(found[None], speed_mps, local)[0]
        if (
            gap.min(initial=math.inf) >= 0.0
            and _free(found, speed_mps, segments, walls)
            and within(inside, *found.T).all()
        ):
            return found
        pairs = pairs | (gap < _PAIR_M)
    return None


class _Problem:
    """Length of a polyline with fixed ends, subject to the gaps of some pairs of segments."""

    def __init__(
        self,
        points: np.ndarray,
        speed_mps: float,
        segments: UniformSegments,
        pairs: np.ndarray,
        margin: float,
    ) -> None:
        self.points, self.v, self.margin = points, speed_mps, margin
        self.rows, columns = np.nonzero(pairs)
        # One segment for each pair.
        self.segments = UniformSegments(*(values[columns] for values in segments))
        first, last = self.points[0].tolist(), self.points[-1].tolist()
        self._ends = [tuple(first)], [tuple(last)]
        self._plain = (
            self.rows.tolist(),
            list(zip(*(values.tolist() for values in self.segments[:7]))),
        )

    def solve(self, inside: Walls | None) -> np.ndarray:
        """The polyline at which SLSQP ends, feasible or not."""
        from scipy.optimize import minimize

        bounds = None
        if inside is not None:
            bounds = [*zip(inside.lower_m, inside.upper_m)] * (len(self.points) - 2)

        constraints = {"type": "ineq", "fun": self.slack, "jac": self.slack_gradient}
        found = minimize(
            self.length,
            self.points[1:-1].ravel(),
            jac=self.length_gradient,
            method="SLSQP",
            bounds=bounds,
            constraints=[constraints] if len(self.rows) else [],
            options={"maxiter": 60, "ftol": 1e-7},
        )
        return self.full(found.x[None])[0]

    def full(self, x: np.ndarray) -> np.ndarray:
        """Polylines (b, p, 2) of via points (b, 2 (p - 2))."""
        b = len(x)
        points = np.empty((b, *self.points.shape))
        points[:, 0], points[:, -1] = self.points[0], self.points[-1]
        points[:, 1:-1] = x.reshape(b, -1, 2)
        return points

    def length(self, x: np.ndarray) -> float:
        """The objective, metres."""
        return float(lengths(self.full(x[None]))[0])

    def length_gradient(self, x: np.ndarray) -> np.ndarray:
        """Gradient of length(): at every via point, unit vector in minus unit vector out."""
        step = np.diff(self.full(x[None])[0], axis=0)
        unit = step / np.maximum(np.sqrt((step * step).sum(axis=1)), 1e-9)[:, None]
        gradient: np.ndarray = (unit[:-1] - unit[1:]).ravel()
        return gradient

    def slack(self, x: np.ndarray) -> np.ndarray:
        """Gaps of the pairs above the margin, metres."""
        (first, last), (rows, segments), via = self._ends, self._plain, x.tolist()
        points = first + list(zip(via[::2], via[1::2])) + last
        return np.array(path_gaps(points, self.v, rows, segments)) - self.margin

    def slack_gradient(self, x: np.ndarray) -> np.ndarray:
        """Gradient of slack(), (pairs, via coordinates), by finite differences."""
        trials = np.concatenate([x[None], x + _DIFFERENCE_M * np.eye(len(x))])
        slacks = self._slacks(trials)
        gradient: np.ndarray = ((slacks[1:] - slacks[0]) / _DIFFERENCE_M).T
        return gradient

    def _slacks(self, x: np.ndarray) -> np.ndarray:
        return pair_gaps(self.full(x), self.v, self.rows, self.segments) - self.margin
