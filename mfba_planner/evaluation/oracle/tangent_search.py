# SPDX-License-Identifier: Apache-2.0
"""Best-first search along tangents: the visibility graph of moving circles, in space-time.

A shortest trajectory at constant speed consists of straight edges that graze moving circles and
of arcs along their edges. Nodes are points on a circle's edge (widened so that chords between
neighbouring nodes stay outside). The ends of walls are circles at rest, and no edge may touch a
wall. Edges are headings that graze a circle, chords along a circle,
the two headings to its edge at the time it bounces or turns, and the straight line to the goal.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...core.geometry import Point
from ...simulation.constant_velocity_segments import UniformSegments
from ...simulation.obstacle_motion import Walls
from .polyline import FAR_M, edge_gaps, within
from .static_walls import NO_WALLS, StaticWalls

_CHUNK = 20_000  # (edge, segment) pairs evaluated at once: what a cache holds
_MANY, _PARTS = 40, 4  # from so many segments on they are tried in parts
CLEAR_M = 1e-5  # clearance to every circle, so that rounding makes no contact


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchParams:
    """Resolution and limits of the search."""

    chord_rad: float = math.radians(15.0)  # angle between neighbouring nodes along an edge
    bin_s: float = 0.1  # of the arrivals at a circle's edge within it, the best is kept
    batch: int = 12  # nodes expanded at once
    slack_s: float = 0.02  # paths later than the best by no more are kept
    max_paths: int = 3
    max_nodes: int = 30_000  # the search stops at this number


@dataclass(slots=True)
class _Graph:
    """Nodes by number: point, time, segment of its circle (-1: none), side, parent."""

    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)
    t: list[float] = field(default_factory=list)
    segment: list[int] = field(default_factory=list)
    side: list[int] = field(default_factory=list)  # +1 counter-clockwise round the circle
    parent: list[int] = field(default_factory=list)

    def add(self, x: float, y: float, t: float, segment: int, side: int, parent: int) -> int:
        """Append a node and return its number."""
        self.x.append(x)
        self.y.append(y)
        self.t.append(t)
        self.segment.append(segment)
        self.side.append(side)
        self.parent.append(parent)
        return len(self.x) - 1

    def path(self, node: int) -> list[int]:
        """Nodes from the start to this one."""
        path = []
        while node >= 0:
            path.append(node)
            node = self.parent[node]
        return path[::-1]


class Search:
    """Tangent search among the given segments of obstacle motion."""

    def __init__(
        self,
        start: Point,
        goal: Point,
        speed_mps: float,
        segments: UniformSegments,
        params: SearchParams,
        inside: Walls | None = None,
        until_s: float | None = None,
        walls: StaticWalls = NO_WALLS,
        to_go: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
        bound_s: float = math.inf,
    ) -> None:
        """Prepare; speed in m/s; all paths stay within the rectangle inside, if given.

        until_s is until when the segments tell the whole motion; None: until the last one ends.
        The ends of the walls have to be among the segments. to_go is a lower bound of the
        distance to the goal, the straight line by default; bound_s the duration of a known path.
        """
        self.start, self.goal, self.v, self.segments = start, goal, speed_mps, segments
        self.params, self.inside, self.walls, self.bound_s = params, inside, walls, bound_s
        self.to_go = to_go or self._straight_to_go
        self.inner = segments._replace(radius=segments.radius + CLEAR_M)
        self.edge = (segments.radius + 2.0 * CLEAR_M) / math.cos(params.chord_rad / 2.0)
        self.end_x = segments.x + segments.vx * (segments.t1 - segments.t0)
        self.end_y = segments.y + segments.vy * (segments.t1 - segments.t0)
        same = segments.obstacle[1:] == segments.obstacle[:-1]
        self.kinked = np.append(same, False)  # the next segment is of the same obstacle
        self.horizon = float(segments.t1.max()) if until_s is None else until_s
        fast = segments.vx**2 + segments.vy**2 >= speed_mps**2
        self.roots = (1.0, -1.0) if fast.any() else (1.0,)

    def paths(self) -> list[np.ndarray]:
        """Paths (p, 2) from start to goal, shortest first; empty when none is found."""
        graph = _Graph()
        root = graph.add(*self.start, 0.0, -1, 0, -1)
        first = float(self.to_go(np.array(self.start[:1]), np.array(self.start[1:]))[0])
        heap = [(first / self.v, root)]
        best: dict[tuple[int, int, int], float] = {}
        arrivals: list[tuple[float, int]] = []
        limit = self.bound_s + self.params.slack_s
        while heap and len(graph.x) < self.params.max_nodes:
            batch: list[int] = []
            while heap and len(batch) < self.params.batch and heap[0][0] <= limit:
                f, node = heapq.heappop(heap)
                if graph.segment[node] >= 0 and best[self._key(graph, node)] < f:
                    continue  # a better node was found since
                batch.append(node)
            if not batch:
                break
            for f, x, y, t, segment, side, parent in self._expand(graph, batch, limit):
                if segment == -2:
                    arrivals.append((f, graph.add(x, y, t, segment, side, parent)))
                    limit = min(limit, f + self.params.slack_s)
                    continue
                key = (segment, side, int(t / self.params.bin_s))
                if f < best.get(key, math.inf):
                    best[key] = f
                    heapq.heappush(heap, (f, graph.add(x, y, t, segment, side, parent)))
        return self._pick(graph, sorted(arrivals), limit)

    def _key(self, graph: _Graph, node: int) -> tuple[int, int, int]:
        return (graph.segment[node], graph.side[node], int(graph.t[node] / self.params.bin_s))

    def _pick(
        self, graph: _Graph, arrivals: list[tuple[float, int]], limit: float
    ) -> list[np.ndarray]:
        """The shortest path for each sequence of (obstacle, side)."""
        found: dict[tuple[tuple[int, int], ...], np.ndarray] = {}
        for f, node in arrivals:
            if f > limit or len(found) >= self.params.max_paths:
                break
            path = graph.path(node)
            passed = [
                (int(self.segments.obstacle[graph.segment[n]]), graph.side[n])
                for n in path
                if graph.segment[n] >= 0
            ]
            name = tuple(dict.fromkeys(passed))
            if name not in found:
                found[name] = np.array([(graph.x[n], graph.y[n]) for n in path])
        return list(found.values())

    def _expand(
        self, graph: _Graph, batch: list[int], limit: float
    ) -> list[tuple[float, float, float, float, int, int, int]]:
        """All free edges from some nodes: (f, x, y, t, segment, side, parent) at their ends."""
        x, y, t = (np.array([column[n] for n in batch]) for column in (graph.x, graph.y, graph.t))
        segment = np.array([graph.segment[n] for n in batch])
        side = np.array([graph.side[n] for n in batch])
        edges = [self._to_goal(x, y, t), *self._grazes(x, y, t, segment), *self._kinks(x, y, t)]
        if (segment >= 0).any():
            edges.append(self._along(x, y, t, segment, side))
        origin, ex, ey, et, esegment, eside = (np.concatenate(column) for column in zip(*edges))
        f = et + self.to_go(ex, ey) / self.v
        keep = np.flatnonzero((f <= limit) & (et <= self.horizon) & within(self.inside, ex, ey))
        origin, ex, ey, et, esegment, eside, f = (
            column[keep] for column in (origin, ex, ey, et, esegment, eside, f)
        )
        ox, oy = x[origin], y[origin]
        free = np.flatnonzero(self._misses(ox, oy, t[origin], ex, ey, et))
        origins = np.stack([ox, oy], axis=1)[free]
        steps = np.stack([ex, ey], axis=1)[free] - origins
        free = free[self.walls.clear(origins, steps, CLEAR_M)]
        parents = [batch[o] for o in origin[free].tolist()]
        return list(
            zip(
                f[free].tolist(),
                ex[free].tolist(),
                ey[free].tolist(),
                et[free].tolist(),
                esegment[free].tolist(),
                eside[free].tolist(),
                parents,
            )
        )

    def _misses(
        self,
        x: np.ndarray,
        y: np.ndarray,
        t: np.ndarray,
        end_x: np.ndarray,
        end_y: np.ndarray,
        end_t: np.ndarray,
    ) -> np.ndarray:
        """Which edges (n,) have no contact with any circle.

        Among many circles an edge is mostly stopped by several: a part of them is tried first.
        Taken in parts that a cache holds.
        """
        span = np.maximum(end_t - t, 1e-12)
        columns = x, y, t, end_t, (end_x - x) / span, (end_y - y) / span
        left, count = np.arange(len(x)), len(self.segments.t0)
        for first in range(_PARTS if count >= _MANY else 1):
            step = _PARTS if count >= _MANY else 1
            part = UniformSegments(*(column[first::step] for column in self.inner))
            rows = max(1, _CHUNK // max(1, len(part.t0)))
            kept = [left[:0]]
            for k in range(0, len(left), rows):
                block = left[k : k + rows]
                ox, oy, start, end, ux, uy = (column[block, None] for column in columns)
                gap = edge_gaps(ox, oy, start, end, ux, uy, part)
                kept.append(block[gap.min(axis=1, initial=FAR_M) >= -1e-9])
            left = np.concatenate(kept)
        free = np.zeros(len(x), dtype=bool)
        free[left] = True
        return free

    def _straight_to_go(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        distance: np.ndarray = np.hypot(x - self.goal[0], y - self.goal[1])
        return distance

    def _to_goal(self, x: np.ndarray, y: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
        n = len(x)
        gx, gy = np.full(n, self.goal[0]), np.full(n, self.goal[1])
        arrival = t + np.hypot(gx - x, gy - y) / self.v
        return np.arange(n), gx, gy, arrival, np.full(n, -2), np.zeros(n, dtype=int)

    def _grazes(
        self, x: np.ndarray, y: np.ndarray, t: np.ndarray, segment: np.ndarray
    ) -> list[tuple[np.ndarray, ...]]:
        """Headings that graze a circle during its segment, on either side."""
        segments = self.segments
        dx = segments.x + segments.vx * (t[:, None] - segments.t0) - x[:, None]
        dy = segments.y + segments.vy * (t[:, None] - segments.t0) - y[:, None]
        d2 = dx * dx + dy * dy
        reach = np.sqrt(np.maximum(d2 - self.edge**2, 0.0))
        outside = (d2 > self.edge**2 * (1.0 + 1e-9)) & (segments.t1 > t[:, None])
        on = np.flatnonzero(segment >= 0)
        outside[on, segment[on]] = False
        slack = self.v**2 - segments.vx**2 - segments.vy**2
        edges: list[tuple[np.ndarray, ...]] = []
        for s in (1, -1):
            tx = (dx * reach + s * dy * self.edge) / np.maximum(d2, 1e-9)
            ty = (dy * reach - s * dx * self.edge) / np.maximum(d2, 1e-9)
            along = segments.vx * tx + segments.vy * ty
            under = along * along + slack
            for root in self.roots:
                closing = -along + root * np.sqrt(np.maximum(under, 0.0))
                wait = reach / np.maximum(closing, 1e-9)
                end = t[:, None] + wait
                valid = outside & (under >= 0.0) & (closing > 1e-9)
                valid &= (end >= segments.t0) & (end <= segments.t1)
                i, j = np.nonzero(valid)
                w = wait[i, j]
                ex = x[i] + (closing[i, j] * tx[i, j] + segments.vx[j]) * w
                ey = y[i] + (closing[i, j] * ty[i, j] + segments.vy[j]) * w
                edges.append((i, ex, ey, end[i, j], j, np.full(len(i), s)))
        return edges

    def _kinks(self, x: np.ndarray, y: np.ndarray, t: np.ndarray) -> list[tuple[np.ndarray, ...]]:
        """Points on a circle's edge reached at the time it bounces or turns."""
        if not self.kinked.any():
            return []
        dx, dy = self.end_x - x[:, None], self.end_y - y[:, None]
        d = np.sqrt(dx * dx + dy * dy)
        wait = self.segments.t1 - t[:, None]
        travel = self.v * wait
        a = (travel * travel - self.edge**2 + d * d) / (2.0 * np.maximum(d, 1e-9))
        h2 = travel * travel - a * a
        i, j = np.nonzero(self.kinked & (wait > 1e-6) & (h2 > 0.0) & (d > 1e-9))
        d, a, h = d[i, j], a[i, j], np.sqrt(h2[i, j])
        nx, ny = dx[i, j] / d, dy[i, j] / d
        # the left one of the two points has the circle on its right: clockwise round it
        return [
            (
                i,
                x[i] + a * nx - s * h * ny,
                y[i] + a * ny + s * h * nx,
                self.segments.t1[j],
                j + 1,
                np.full(len(i), -s),
            )
            for s in (1, -1)
        ]

    def _along(
        self, x: np.ndarray, y: np.ndarray, t: np.ndarray, segment: np.ndarray, side: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """One chord along the circle's edge."""
        i = np.flatnonzero(segment >= 0)
        j, s = segment[i], side[i]
        vx, vy = self.segments.vx[j], self.segments.vy[j]
        since = t[i] - self.segments.t0[j]
        rx = x[i] - self.segments.x[j] - vx * since
        ry = y[i] - self.segments.y[j] - vy * since
        angle = np.arctan2(ry, rx) + s * self.params.chord_rad
        qx, qy = self.edge[j] * np.cos(angle) - rx, self.edge[j] * np.sin(angle) - ry
        a = self.v**2 - vx**2 - vy**2
        b = qx * vx + qy * vy
        # |q + w dt| = v dt
        under = b * b + a * (qx * qx + qy * qy)
        with np.errstate(divide="ignore", invalid="ignore"):
            wait = (b + np.sqrt(under)) / a
        end = t[i] + wait
        ok = (under >= 0.0) & (wait > 0.0) & (end <= self.segments.t1[j])
        i, j, s, wait, end = i[ok], j[ok], s[ok], wait[ok], end[ok]
        ex = x[i] + qx[ok] + vx[ok] * wait
        ey = y[i] + qy[ok] + vy[ok] * wait
        return i, ex, ey, end, j, s
