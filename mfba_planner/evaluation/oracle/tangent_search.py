# SPDX-License-Identifier: Apache-2.0
"""Best-first search along tangents: the visibility graph of moving circles, in space-time.

A shortest trajectory at constant speed is made of straight legs that graze moving circles and
of stretches along their edges. Nodes are places on a circle's edge (widened so that chords
between neighbouring nodes stay outside); edges are headings that graze a circle, chords along
one, the two ways to be at its edge when it bounces or turns, and the way to the goal.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field

import numpy as np

from ...core.geometry import Point
from ...simulation.obstacle_motion import Walls
from ...simulation.uniform_segments import UniformSegments
from .polyline import edge_gaps, within

CLEAR_M = 1e-5  # kept from every circle, so that rounding cannot make contact


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchParams:
    """How fine the search is."""

    chord_rad: float = math.radians(15.0)  # angle between neighbouring nodes along an edge
    bin_s: float = 0.1  # of two arrivals at a circle's edge within it, the better counts
    batch: int = 12  # nodes expanded at a time
    slack_s: float = 0.02  # other ways that are later than the best by no more are kept
    ways: int = 3  # at the most so many ways
    max_nodes: int = 30_000  # gives up beyond


@dataclass(slots=True)
class _Graph:
    """Nodes by number: place, time, leg of the circle it lies on (-1: none), side, parent."""

    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)
    t: list[float] = field(default_factory=list)
    leg: list[int] = field(default_factory=list)
    side: list[int] = field(default_factory=list)  # +1 counter-clockwise round the circle
    parent: list[int] = field(default_factory=list)

    def add(self, x: float, y: float, t: float, leg: int, side: int, parent: int) -> int:
        """Append a node and return its number."""
        self.x.append(x)
        self.y.append(y)
        self.t.append(t)
        self.leg.append(leg)
        self.side.append(side)
        self.parent.append(parent)
        return len(self.x) - 1

    def way(self, node: int) -> list[int]:
        """Nodes from the start to this one."""
        way = []
        while node >= 0:
            way.append(node)
            node = self.parent[node]
        return way[::-1]


class Search:
    """Tangent search among the given legs, all of them obstacles."""

    def __init__(
        self,
        start: Point,
        goal: Point,
        speed_mps: float,
        segments: UniformSegments,
        params: SearchParams,
        inside: Walls | None = None,
    ) -> None:
        """Prepare; speed in m/s; all ways stay within the rectangle inside, if there is one."""
        self.start, self.goal, self.v, self.segments = start, goal, speed_mps, segments
        self.params, self.inside = params, inside
        self.inner = segments._replace(radius=segments.radius + CLEAR_M)
        self.edge = (segments.radius + 2.0 * CLEAR_M) / math.cos(params.chord_rad / 2.0)
        self.end_x = segments.x + segments.vx * (segments.t1 - segments.t0)
        self.end_y = segments.y + segments.vy * (segments.t1 - segments.t0)
        same = segments.obstacle[1:] == segments.obstacle[:-1]
        self.kinked = np.append(same, False)  # the next leg is the same obstacle's
        self.horizon = float(segments.t1.max())
        fast = segments.vx**2 + segments.vy**2 >= speed_mps**2
        self.roots = (1.0, -1.0) if fast.any() else (1.0,)

    def ways(self) -> list[np.ndarray]:
        """Ways from start to goal, (p, 2) each, best first; none when there is none."""
        graph = _Graph()
        root = graph.add(*self.start, 0.0, -1, 0, -1)
        heap = [(math.dist(self.start, self.goal) / self.v, root)]
        best: dict[tuple[int, int, int], float] = {}
        arrivals: list[tuple[float, int]] = []
        limit = math.inf
        while heap and len(graph.x) < self.params.max_nodes:
            batch: list[int] = []
            while heap and len(batch) < self.params.batch and heap[0][0] <= limit:
                f, node = heapq.heappop(heap)
                if graph.leg[node] >= 0 and best[self._key(graph, node)] < f:
                    continue  # overtaken since
                batch.append(node)
            if not batch:
                break
            for f, x, y, t, leg, side, parent in self._expand(graph, batch, limit):
                if leg == -2:
                    arrivals.append((f, graph.add(x, y, t, leg, side, parent)))
                    limit = min(limit, f + self.params.slack_s)
                    continue
                key = (leg, side, int(t / self.params.bin_s))
                if f < best.get(key, math.inf):
                    best[key] = f
                    heapq.heappush(heap, (f, graph.add(x, y, t, leg, side, parent)))
        return self._pick(graph, sorted(arrivals), limit)

    def _key(self, graph: _Graph, node: int) -> tuple[int, int, int]:
        return (graph.leg[node], graph.side[node], int(graph.t[node] / self.params.bin_s))

    def _pick(
        self, graph: _Graph, arrivals: list[tuple[float, int]], limit: float
    ) -> list[np.ndarray]:
        """The best of each sequence of (obstacle, side)."""
        found: dict[tuple[tuple[int, int], ...], np.ndarray] = {}
        for f, node in arrivals:
            if f > limit or len(found) >= self.params.ways:
                break
            way = graph.way(node)
            passed = [
                (int(self.segments.obstacle[graph.leg[n]]), graph.side[n])
                for n in way
                if graph.leg[n] >= 0
            ]
            name = tuple(dict.fromkeys(passed))
            if name not in found:
                found[name] = np.array([(graph.x[n], graph.y[n]) for n in way])
        return list(found.values())

    def _expand(
        self, graph: _Graph, batch: list[int], limit: float
    ) -> list[tuple[float, float, float, float, int, int, int]]:
        """All free edges out of some nodes: (f, x, y, t, leg, side, parent) at their ends."""
        x, y, t = (np.array([column[n] for n in batch]) for column in (graph.x, graph.y, graph.t))
        leg = np.array([graph.leg[n] for n in batch])
        side = np.array([graph.side[n] for n in batch])
        parts = [self._to_goal(x, y, t), *self._grazes(x, y, t, leg), *self._kinks(x, y, t)]
        if (leg >= 0).any():
            parts.append(self._along(x, y, t, leg, side))
        origin, ex, ey, et, eleg, eside = (np.concatenate(column) for column in zip(*parts))
        f = et + np.hypot(ex - self.goal[0], ey - self.goal[1]) / self.v
        keep = np.flatnonzero((f <= limit) & (et <= self.horizon) & within(self.inside, ex, ey))
        origin, ex, ey, et, eleg, eside, f = (
            column[keep] for column in (origin, ex, ey, et, eleg, eside, f)
        )
        span = np.maximum(et - t[origin], 1e-12)
        ox, oy = x[origin], y[origin]
        gap = edge_gaps(
            ox[:, None],
            oy[:, None],
            t[origin][:, None],
            et[:, None],
            ((ex - ox) / span)[:, None],
            ((ey - oy) / span)[:, None],
            self.inner,
        )
        free = np.flatnonzero(gap.min(axis=1) >= -1e-9)
        parents = [batch[o] for o in origin[free].tolist()]
        return list(
            zip(
                f[free].tolist(),
                ex[free].tolist(),
                ey[free].tolist(),
                et[free].tolist(),
                eleg[free].tolist(),
                eside[free].tolist(),
                parents,
            )
        )

    def _to_goal(self, x: np.ndarray, y: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
        n = len(x)
        gx, gy = np.full(n, self.goal[0]), np.full(n, self.goal[1])
        arrival = t + np.hypot(gx - x, gy - y) / self.v
        return np.arange(n), gx, gy, arrival, np.full(n, -2), np.zeros(n, dtype=int)

    def _grazes(
        self, x: np.ndarray, y: np.ndarray, t: np.ndarray, leg: np.ndarray
    ) -> list[tuple[np.ndarray, ...]]:
        """Headings that graze a circle while its leg lasts, on either side."""
        segments = self.segments
        dx = segments.x + segments.vx * (t[:, None] - segments.t0) - x[:, None]
        dy = segments.y + segments.vy * (t[:, None] - segments.t0) - y[:, None]
        d2 = dx * dx + dy * dy
        reach = np.sqrt(np.maximum(d2 - self.edge**2, 0.0))
        outside = (d2 > self.edge**2 * (1.0 + 1e-9)) & (segments.t1 > t[:, None])
        on = np.flatnonzero(leg >= 0)
        outside[on, leg[on]] = False
        slack = self.v**2 - segments.vx**2 - segments.vy**2
        parts: list[tuple[np.ndarray, ...]] = []
        for s in (1, -1):
            tx = (dx * reach + s * dy * self.edge) / np.maximum(d2, 1e-9)
            ty = (dy * reach - s * dx * self.edge) / np.maximum(d2, 1e-9)
            along = segments.vx * tx + segments.vy * ty
            under = along * along + slack
            for root in self.roots:
                closing = -along + root * np.sqrt(np.maximum(under, 0.0))
                wait = reach / np.maximum(closing, 1e-9)
                end = t[:, None] + wait
                good = outside & (under >= 0.0) & (closing > 1e-9)
                good &= (end >= segments.t0) & (end <= segments.t1)
                i, j = np.nonzero(good)
                w = wait[i, j]
                ex = x[i] + (closing[i, j] * tx[i, j] + segments.vx[j]) * w
                ey = y[i] + (closing[i, j] * ty[i, j] + segments.vy[j]) * w
                parts.append((i, ex, ey, end[i, j], j, np.full(len(i), s)))
        return parts

    def _kinks(self, x: np.ndarray, y: np.ndarray, t: np.ndarray) -> list[tuple[np.ndarray, ...]]:
        """Places on a circle's edge that are reached just when it bounces or turns."""
        if not self.kinked.any():
            return []
        dx, dy = self.end_x - x[:, None], self.end_y - y[:, None]
        d = np.sqrt(dx * dx + dy * dy)
        wait = self.segments.t1 - t[:, None]
        way = self.v * wait
        a = (way * way - self.edge**2 + d * d) / (2.0 * np.maximum(d, 1e-9))
        h2 = way * way - a * a
        i, j = np.nonzero(self.kinked & (wait > 1e-6) & (h2 > 0.0) & (d > 1e-9))
        d, a, h = d[i, j], a[i, j], np.sqrt(h2[i, j])
        nx, ny = dx[i, j] / d, dy[i, j] / d
        # seen from here the left place has the circle on its right: clockwise round it
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
        self, x: np.ndarray, y: np.ndarray, t: np.ndarray, leg: np.ndarray, side: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """One chord further along the circle's edge."""
        i = np.flatnonzero(leg >= 0)
        j, s = leg[i], side[i]
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
