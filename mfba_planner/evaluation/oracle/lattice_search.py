# SPDX-License-Identifier: Apache-2.0
"""Lattice search: all headings, one time step after another; independent of the tangent search.

Used where the tangent search finds nothing, and to check its longer paths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...core.geometry import Point
from ...simulation.constant_velocity_segments import UniformSegments
from ...simulation.obstacle_motion import Walls
from .polyline import edge_gaps, within
from .static_walls import NO_WALLS, StaticWalls
from .tangent_search import CLEAR_M

_CHUNK = 20_000  # (edge, segment) pairs evaluated at once: what a cache holds
_PAIR_CHUNK = 300  # (point, segment) pairs evaluated at once; each has many headings
_SLACK_M = 1e-6  # added to the reach, for rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class LatticeParams:
    """Resolution of the lattice."""

    step_s: float = 0.5
    headings: int = 32
    cell_m: float = 0.2  # of the points in a cell at one time, the nearest to the goal is kept
    max_paths: int = 4
    slack_s: float = 0.3  # paths that arrive later than the first one by more are dropped


def lattice_paths(
    start: Point,
    goal: Point,
    speed_mps: float,
    segments: UniformSegments,
    limit_s: float,
    params: LatticeParams,
    inside: Walls | None = None,
    walls: StaticWalls = NO_WALLS,
    to_go: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> list[np.ndarray]:
    """Free paths (p, 2) from start to goal within limit_s, shortest first.

    to_go is a lower bound of the distance to the goal, the straight line by default.
    """
    angles = np.arange(params.headings) * (2.0 * math.pi / params.headings)
    angles += math.atan2(goal[1] - start[1], goal[0] - start[0])
    u = speed_mps * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    layers, parents = [np.array([start])], [np.array([-1])]
    arrivals: list[tuple[float, int, int]] = []
    inner = segments._replace(radius=segments.radius + CLEAR_M)
    t = 0.0
    while len(layers[-1]) and t < limit_s:
        points, layer = layers[-1], len(layers) - 1
        left = np.array(goal) - points
        rest_s = np.hypot(left[:, 0], left[:, 1]) / speed_mps
        to_goal = left / np.maximum(rest_s, 1e-9)[:, None]
        inner = _during(inner, t, math.inf)
        direct = _free(points, to_goal, t, t + rest_s, inner)
        direct &= walls.clear(points, left, CLEAR_M)
        for n in np.flatnonzero(direct).tolist():
            arrivals.append((t + float(rest_s[n]), layer, n))
            limit_s = min(limit_s, t + float(rest_s[n]) + params.slack_s)
        successors = (points[:, None] + u * params.step_s).reshape(-1, 2)
        left = np.array(goal) - successors
        rest_m = to_go(*successors.T) if to_go else np.hypot(left[:, 0], left[:, 1])
        f = t + params.step_s + rest_m / speed_mps
        kept = np.flatnonzero((f <= limit_s) & within(inside, *successors.T))
        kept = kept[np.argsort(f[kept], kind="stable")]
        column, row = np.floor(successors[kept] / params.cell_m).astype(np.int64).T
        cells = (column << 32) + row  # one number per cell: rows would be sorted as bytes
        # edges first: the best point of a cell may be unreachable
        now = _during(inner, t, t + params.step_s)
        free = _free_steps(points, u, t, t + params.step_s, kept, now)
        free &= walls.clear_steps(points, u * params.step_s, kept, CLEAR_M)
        kept, cells = kept[free], cells[free]
        _, first = np.unique(cells, return_index=True)
        kept = kept[np.sort(first)]
        layers.append(successors[kept])
        parents.append(kept // len(u))
        t += params.step_s
    return [
        _backtrack(layers, parents, arrival, goal)
        for arrival in sorted(arrivals)[: params.max_paths]
    ]


def _during(segments: UniformSegments, start_s: float, end_s: float) -> UniformSegments:
    """The segments that overlap an interval."""
    keep = (segments.t1 >= start_s) & (segments.t0 <= end_s)
    return UniformSegments(*(column[keep] for column in segments))


def _free(
    points: np.ndarray, velocity: np.ndarray, t: float, end: np.ndarray, segments: UniformSegments
) -> np.ndarray:
    """Which straight edges that start at t have no contact, (n,)."""
    if not segments.t0.size:
        return np.full(len(points), True)
    rows = max(1, _CHUNK // segments.t0.size)
    blocks = []
    for k in range(0, len(points), rows):
        block = slice(k, k + rows)
        gap = edge_gaps(
            points[block, 0, None],
            points[block, 1, None],
            np.full((len(points[block]), 1), t),
            end[block, None],
            velocity[block, 0, None],
            velocity[block, 1, None],
            segments,
        )
        blocks.append(gap.min(axis=1) >= 0.0)
    return np.concatenate(blocks) if blocks else np.zeros(0, dtype=bool)


def _free_steps(
    points: np.ndarray,
    u: np.ndarray,
    t: float,
    end: float,
    steps: np.ndarray,
    segments: UniformSegments,
) -> np.ndarray:
    """_free() of steps with velocities u (h, 2) until end; step n starts at points[n // h].

    Skips segments that are too far from a point for any step from it to touch.
    """
    requested, touched = np.zeros((2, len(points) * len(u)), dtype=bool)
    requested[steps] = True
    for origin, segment in _pairs_in_reach(points, float(np.hypot(*u[0])), t, end, segments):
        step = origin[:, None] * len(u) + np.arange(len(u))
        which = np.nonzero(requested[step])
        step, near, heading = step[which], segment[which[0]], u[which[1]]
        (x, y), (ux, uy) = points[step // len(u)].T, heading.T
        start, until = np.full(len(step), t), np.full(len(step), end)
        nearby = UniformSegments(*(column[near] for column in segments))
        gap = edge_gaps(x, y, start, until, ux, uy, nearby)
        touched[step[gap < 0.0]] = True
    free: np.ndarray = ~touched[steps]
    return free


def _pairs_in_reach(
    points: np.ndarray, speed_mps: float, t: float, end: float, segments: UniformSegments
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """(point, segment) pairs in which a robot at the point at t may touch until end; in chunks."""
    nearest_t = np.clip(t, segments.t0, segments.t1)
    x, y = (
        segments.x + segments.vx * (nearest_t - segments.t0),
        segments.y + segments.vy * (nearest_t - segments.t0),
    )
    reach = (
        segments.radius + (speed_mps + np.hypot(segments.vx, segments.vy)) * (end - t) + _SLACK_M
    )
    dx, dy = x - points[:, :1], y - points[:, 1:]
    origin, segment = np.nonzero(dx * dx + dy * dy <= reach * reach)
    for k in range(0, len(origin), _PAIR_CHUNK):
        yield origin[k : k + _PAIR_CHUNK], segment[k : k + _PAIR_CHUNK]


def _backtrack(
    layers: list[np.ndarray],
    parents: list[np.ndarray],
    arrival: tuple[float, int, int],
    goal: Point,
) -> np.ndarray:
    _, layer, n = arrival
    path = [np.array(goal)]
    while layer >= 0:
        path.append(layers[layer][n])
        n = int(parents[layer][n])
        layer -= 1
    return np.array(path[::-1])
