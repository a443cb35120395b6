# SPDX-License-Identifier: Apache-2.0
"""A plain search that shares no idea with the tangents: all headings, step by step in time.

For worlds where tangents find nothing, and as a second opinion on those where they do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point
from ..core.legs import Legs
from ..core.world import Walls
from .polyline import edge_gaps, within
from .tangents import CLEAR_M

_CHUNK = 2_000_000  # pairs of edge and leg looked at together: memory


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
    legs: Legs,
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
    inner = legs._replace(radius=legs.radius + CLEAR_M)
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
        origin = np.repeat(np.arange(len(here)), len(u))
        velocity = np.tile(u, (len(here), 1))
        there = here[origin] + velocity * params.step_s
        left = np.array(goal) - there
        f = t + params.step_s + np.hypot(left[:, 0], left[:, 1]) / speed_mps
        order = np.argsort(f, kind="stable")
        order = order[(f <= limit_s)[order] & within(inside, *there[order].T)]
        cells = np.floor(there[order] / params.cell_m).astype(np.int64)
        # edges first: the best place of a cell may be out of reach
        end = np.full(len(order), t + params.step_s)
        now = _during(inner, t, t + params.step_s)
        free = _free(here[origin[order]], velocity[order], t, end, now)
        order, cells = order[free], cells[free]
        _, first = np.unique(cells, axis=0, return_index=True)
        order = order[np.sort(first)]
        places.append(there[order])
        parents.append(origin[order])
        t += params.step_s
    return [_way(places, parents, one, goal) for one in sorted(arrivals)[: params.ways]]


def _during(legs: Legs, begin_s: float, end_s: float) -> Legs:
    """The legs that last at some time of an interval."""
    keep = (legs.t1 >= begin_s) & (legs.t0 <= end_s)
    return Legs(*(column[keep] for column in legs))


def _free(
    here: np.ndarray, velocity: np.ndarray, t: float, end: np.ndarray, legs: Legs
) -> np.ndarray:
    """Which of the straight legs that begin at t touch nothing, (n,)."""
    if not legs.t0.size:
        return np.full(len(here), True)
    rows = max(1, _CHUNK // legs.t0.size)
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
            legs,
        )
        parts.append(gap.min(axis=1) >= 0.0)
    return np.concatenate(parts) if parts else np.zeros(0, dtype=bool)


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
