# SPDX-License-Identifier: Apache-2.0
"""Proof that a goal cannot be reached: reachable grid cells over time.

Every approximation favours the robot: a cell is free unless it lies wholly inside a circle,
circles are tested only at the ticks of the time grid, every step is rounded up to whole cells,
speeds from 0 to the robot's own are allowed, and a robot that leaves the area may return anywhere
at any later time. So a goal that is not reached here cannot be reached at all. Cells that walls
separate from the start are not reached at any time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...core.segments import Segments
from ...simulation.constant_velocity_segments import UniformSegments
from ...simulation.scenario import Scenario

GOAL_TOLERANCE_M = 0.05  # larger than the tolerance of any planner here
_INSTANT_S = 1e-9  # rounding of a sum of times


@dataclass(frozen=True, slots=True, kw_only=True)
class ReachParams:
    """Grid of the proof."""

    cell_m: float = 0.075
    step_s: float = 0.25
    border_m: float = 3.0  # beyond start, goal and walls


def unreachable(
    scenario: Scenario,
    speed_mps: float,
    segments: UniformSegments,
    params: ReachParams | None = None,
) -> str:
    """Reason why no trajectory at up to speed_mps reaches the goal; "" when not proven.

    segments must cover the scenario's time limit.
    """
    from scipy.ndimage import distance_transform_edt

    p = params or ReachParams()
    xs, ys = _axes(scenario, p)
    half = p.cell_m / math.sqrt(2.0)
    open_cells = _open_cells(scenario, xs, ys, half)
    gx, gy = scenario.goal_m
    goal = np.hypot(xs[:, None] - gx, ys[None, :] - gy) <= half + GOAL_TOLERANCE_M
    sx, sy = scenario.start_m
    reached = np.hypot(xs[:, None] - sx, ys[None, :] - sy) <= half + 1e-9
    edge = np.zeros_like(reached)
    edge[[0, -1], :] = edge[:, [0, -1]] = True
    # any point of one cell to any point of another: distance of centres plus a diagonal
    stride = (speed_mps * p.step_s + 2.0 * half) / p.cell_m + 1e-9
    outside = False
    if not (goal & open_cells).any():
        return "walls enclose the start or goal_m"
    for tick in range(1, math.ceil(scenario.time_limit_s / p.step_s) + 1):
        before_s, now_s = (tick - 1) * p.step_s, tick * p.step_s
        outside = outside or bool((reached & edge).any())
        reached = distance_transform_edt(~reached) <= stride
        if outside:
            reached |= edge
        reached &= open_cells
        if (reached & goal).any() and not _goal_covered(scenario, segments, before_s, now_s):
            return ""
        reached &= ~_covered(xs, ys, segments, now_s, half)
        if not reached.any():
            return f"contact cannot be avoided beyond t = {now_s:g} s"
    return f"goal_m cannot be reached within the time limit of {scenario.time_limit_s:g} s"


def _goal_covered(
    scenario: Scenario, segments: UniformSegments, start_s: float, end_s: float
) -> bool:
    """Whether one circle covers the goal with its tolerance during [start_s, end_s].

    The distance to uniform motion is convex in t: it is largest at the ends of a segment.
    """
    gx, gy = scenario.goal_m
    active = (segments.t0 <= end_s) & (segments.t1 >= start_s)
    furthest = np.zeros(len(segments.t0))
    for t in (np.maximum(segments.t0, start_s), np.minimum(segments.t1, end_s)):
        x, y = (
            segments.x + segments.vx * (t - segments.t0),
            segments.y + segments.vy * (t - segments.t0),
        )
        furthest = np.maximum(furthest, np.hypot(x - gx, y - gy))
    covers = furthest + GOAL_TOLERANCE_M < segments.radius
    shared_s = np.minimum(segments.t1, end_s) - np.maximum(segments.t0, start_s)
    for obstacle in set(segments.obstacle[active].tolist()):
        own = (segments.obstacle == obstacle) & active
        # It must be there all the time.
        if covers[own].all() and shared_s[own].sum() >= end_s - start_s - _INSTANT_S:
            return True
    return False


def _axes(scenario: Scenario, p: ReachParams) -> tuple[np.ndarray, np.ndarray]:
    """Centres of the cells along x and y."""
    corners = [scenario.start_m, scenario.goal_m]
    if scenario.walls is not None:
        corners += [scenario.walls.lower_m, scenario.walls.upper_m]
    low = np.min(corners, axis=0) - p.border_m
    high = np.max(corners, axis=0) + p.border_m
    return tuple(np.arange(a, b, p.cell_m) for a, b in zip(low, high))  # type: ignore[return-value]


def _open_cells(scenario: Scenario, xs: np.ndarray, ys: np.ndarray, half: float) -> np.ndarray:
    """Cells that walls do not separate from the start, at any speed.

    A cell is closed if it lies wholly within the robot's radius of a wall; cells are connected by
    sides and corners, and round the outside of the grid.
    """
    from scipy.ndimage import label

    shape = (len(xs), len(ys))
    if not scenario.segments_m:
        return np.ones(shape, dtype=bool)
    closed = np.zeros(shape, dtype=bool)
    r = scenario.robot_radius_m - half - 1e-9
    for x0, y0, x1, y1 in scenario.segments_m:
        i = slice(*np.searchsorted(xs, (min(x0, x1) - r, max(x0, x1) + r)))
        j = slice(*np.searchsorted(ys, (min(y0, y1) - r, max(y0, y1) + r)))
        near = Segments.of([(x0, y0, x1, y1)]).distances(xs[i, None, None], ys[None, j, None])
        closed[i, j] |= near[:, :, 0] < r
    parts, _ = label(np.pad(~closed, 1, constant_values=True), np.ones((3, 3)))
    parts = parts[1:-1, 1:-1]
    sx, sy = scenario.start_m
    at_start = np.hypot(xs[:, None] - sx, ys[None, :] - sy) <= half + 1e-9
    found: np.ndarray = np.isin(parts, parts[at_start & ~closed]) & ~closed
    return found


def _covered(
    xs: np.ndarray, ys: np.ndarray, segments: UniformSegments, t_s: float, half: float
) -> np.ndarray:
    """Cells that lie wholly inside an enlarged circle at time t."""
    covered = np.zeros((len(xs), len(ys)), dtype=bool)
    now = np.flatnonzero((segments.t0 <= t_s) & (t_s <= segments.t1))
    for m in now.tolist():
        cx = segments.x[m] + segments.vx[m] * (t_s - segments.t0[m])
        cy = segments.y[m] + segments.vy[m] * (t_s - segments.t0[m])
        r = segments.radius[m] - half - 1e-9
        i = slice(*np.searchsorted(xs, (cx - r, cx + r)))
        j = slice(*np.searchsorted(ys, (cy - r, cy + r)))
        covered[i, j] |= (xs[i, None] - cx) ** 2 + (ys[None, j] - cy) ** 2 < r * r
    return covered
