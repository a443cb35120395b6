# SPDX-License-Identifier: Apache-2.0
"""A plain search that shares no idea with the tangents: all headings, step by step in time.

For worlds where tangents find nothing, and as a second opinion on those where they do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...core.geometry import Point
from ...simulation.obstacle_motion import Walls
from ...simulation.uniform_segments import UniformSegments
from .polyline import edge_gaps, within
from .tangent_search import CLEAR_M

_CHUNK = 20_000  # pairs of edge and leg looked at together: what a cache holds
_AT_ONCE = 300  # the same for pairs of a place and a leg, which have many headings
_SLACK_M = 1e-6  # of what is near: rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class LatticeParams:
    """How fine the lattice is."""

    step_s: float = 0.5
    headings: int = 32
    cell_m: float = 0.2  # of the places in a cell at one time, the nearest to the goal is kept
    ways: int = 4
    slack_s: float = 0.3  # ways that are later than the first found by more do not count


def lattice_ways(
    start: Point,
    goal: Point,
    speed_mps: float,
    segments: UniformSegments,
    limit_s: float,
    params: LatticeParams,
    inside: Walls | None = None,
) -> list[np.ndarray]:
    """Free ways (p, 2) from start to goal that take no longer than limit_s, best first."""
    angles = np.arange(params.headings) * (2.0 * math.pi / params.headings)
    angles += math.atan2(goal[1] - start[1], goal[0] - start[0])
    u = speed_mps * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    places, parents = [np.array([start])], [np.array([-1])]
    arrivals: list[tuple[float, int, int]] = []
    inner = segments._replace(radius=segments.radius + CLEAR_M)
    t = 0.0
    while len(places[-1]) and t < limit_s:
        here, layer = places[-1], len(places) - 1
        left = np.array(goal) - here
        rest = np.hypot(left[:, 0], left[:, 1]) / speed_mps
        home = left / np.maximum(rest, 1e-9)[:, None]
        inner = _during(inner, t, math.inf)
        for n in np.flatnonzero(_free(here, home, t, t + rest, inner)).tolist():
            arrivals.append((t + float(rest[n]), layer, n))
            limit_s = min(limit_s, t + float(rest[n]) + params.slack_s)
        there = (here[:, None] + u * params.step_s).reshape(-1, 2)
        left = np.array(goal) - there
        f = t + params.step_s + np.hypot(left[:, 0], left[:, 1]) / speed_mps
        order = np.flatnonzero((f <= limit_s) & within(inside, *there.T))
        order = order[np.argsort(f[order], kind="stable")]
        column, row = np.floor(there[order] / params.cell_m).astype(np.int64).T
        cells = (column << 32) + row  # one number each: rows would be sorted as bytes
        # edges first: the best place of a cell may be out of reach
        now = _during(inner, t, t + params.step_s)
        free = _free_steps(here, u, t, t + params.step_s, order, now)
        order, cells = order[free], cells[free]
        _, first = np.unique(cells, return_index=True)
        order = order[np.sort(first)]
        places.append(there[order])
        parents.append(order // len(u))
        t += params.step_s
    return [_way(places, parents, one, goal) for one in sorted(arrivals)[: params.ways]]


def _during(segments: UniformSegments, begin_s: float, end_s: float) -> UniformSegments:
    """The legs that last at some time of an interval."""
    keep = (segments.t1 >= begin_s) & (segments.t0 <= end_s)
    return UniformSegments(*(column[keep] for column in segments))


def _free(
    here: np.ndarray, velocity: np.ndarray, t: float, end: np.ndarray, segments: UniformSegments
) -> np.ndarray:
    """Which of the straight legs that begin at t touch nothing, (n,)."""
    if not segments.t0.size:
        return np.full(len(here), True)
    rows = max(1, _CHUNK // segments.t0.size)
    parts = []
    for k in range(0, len(here), rows):
        part = slice(k, k + rows)
        gap = edge_gaps(
            here[part, 0, None],
            here[part, 1, None],
            np.full((len(here[part]), 1), t),
            end[part, None],
            velocity[part, 0, None],
            velocity[part, 1, None],
            segments,
        )
        parts.append(gap.min(axis=1) >= 0.0)
    return np.concatenate(parts) if parts else np.zeros(0, dtype=bool)


def _free_steps(
    here: np.ndarray,
    u: np.ndarray,
    t: float,
    end: float,
    steps: np.ndarray,
    segments: UniformSegments,
) -> np.ndarray:
    """_free() of some steps with velocities u (h, 2) until end; step n begins at here[n // h].

    Most legs are too far from a place to touch a step from there: they are not looked at.
    """
    asked, touched = np.zeros((2, len(here) * len(u)), dtype=bool)
    asked[steps] = True
    for origin, leg in _met(here, float(np.hypot(*u[0])), t, end, segments):
        step = origin[:, None] * len(u) + np.arange(len(u))
        which = np.nonzero(asked[step])
        step, near, heading = step[which], leg[which[0]], u[which[1]]
        (x, y), (ux, uy) = here[step // len(u)].T, heading.T
        begin, until = np.full(len(step), t), np.full(len(step), end)
        those = UniformSegments(*(column[near] for column in segments))
        gap = edge_gaps(x, y, begin, until, ux, uy, those)
        touched[step[gap < 0.0]] = True
    free: np.ndarray = ~touched[steps]
    return free


def _met(
    here: np.ndarray, speed_mps: float, t: float, end: float, segments: UniformSegments
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of a place and a leg that whoever is there at t may touch until end; in parts."""
    seen = np.clip(t, segments.t0, segments.t1)
    x, y = (
        segments.x + segments.vx * (seen - segments.t0),
        segments.y + segments.vy * (seen - segments.t0),
    )
    reach = (
        segments.radius + (speed_mps + np.hypot(segments.vx, segments.vy)) * (end - t) + _SLACK_M
    )
    dx, dy = x - here[:, :1], y - here[:, 1:]
    origin, leg = np.nonzero(dx * dx + dy * dy <= reach * reach)
    for k in range(0, len(origin), _AT_ONCE):
        yield origin[k : k + _AT_ONCE], leg[k : k + _AT_ONCE]


def _way(
    places: list[np.ndarray],
    parents: list[np.ndarray],
    arrival: tuple[float, int, int],
    goal: Point,
) -> np.ndarray:
    _, layer, n = arrival
    way = [np.array(goal)]
    while layer >= 0:
        way.append(places[layer][n])
        n = int(parents[layer][n])
        layer -= 1
    return np.array(way[::-1])
