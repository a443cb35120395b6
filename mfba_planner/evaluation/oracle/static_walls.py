# SPDX-License-Identifier: Apache-2.0
"""Wall segments for the oracle: which edges pass them, and circles round their ends.

A shortest path round a wall consists of tangents and arcs of the circles, of the robot's radius,
round its ends. So the searches get these circles as obstacles at rest, beside the obstacles of the
scenario, and test every edge against the walls themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...core.segments import Segments
from ...simulation.constant_velocity_segments import UniformSegments
from ...simulation.scenario import Scenario

_PAIRS = 200_000  # (edge, wall) pairs evaluated at once
_BLOCK_M = 2.0  # side of the squares in which points are taken together
_SLACK_M = 1e-6  # added to the reach, for rounding


class StaticWalls:
    """The walls of a scenario, enlarged by the robot's radius; falsy without any."""

    def __init__(self, segments: Segments, radius_m: float) -> None:
        """radius_m: that of the robot."""
        self.segments, self.radius_m = segments, radius_m

    @classmethod
    def of(cls, scenario: Scenario) -> StaticWalls:
        """All walls of a scenario."""
        return cls(scenario.segments, scenario.robot_radius_m)

    def __bool__(self) -> bool:
        return bool(self.segments.x.size)

    def select(self, which: Iterable[int]) -> StaticWalls:
        """Some of the walls."""
        chosen = np.array(sorted(which), dtype=np.intp)
        return StaticWalls(self.segments.select(chosen), self.radius_m)

    def clear(self, points: np.ndarray, edges: np.ndarray, margin_m: float) -> np.ndarray:
        """Which edges (n, 2), from points (n, 2), keep radius and margin from all walls."""
        free = np.ones(len(points), dtype=bool)
        if not self or not len(points):
            return free
        rows = max(1, _PAIRS // self.segments.x.size)
        for k in range(0, len(points), rows):
            block = slice(k, k + rows)
            free[block] = self._clear(points[block], edges[block], margin_m)
        return free

    def _clear(self, points: np.ndarray, edges: np.ndarray, margin_m: float) -> np.ndarray:
        s, (x, y), (dx, dy) = self.segments, points.T, edges.T
        # Most edges that are not free cross a wall, which is quickly found.
        px, py = s.x - x[:, None], s.y - y[:, None]
        ux, uy = dx[:, None], dy[:, None]
        qx, qy = px + s.dx, py + s.dy
        crosses = (px * uy - py * ux) * (qx * uy - qy * ux) < 0.0
        crosses &= (s.dx * py - s.dy * px) * (s.dx * (py - uy) - s.dy * (px - ux)) < 0.0
        left = np.flatnonzero(~crosses.any(axis=1))
        distance = s.swept_distances(
            x[left, None], y[left, None], dx[left, None], dy[left, None]
        ).min(axis=1)
        free = np.zeros(len(x), dtype=bool)
        free[left] = distance >= self.radius_m + margin_m
        return free

    def clear_path(self, points: np.ndarray, margin_m: float = 0.0) -> bool:
        """Whether a polyline (p, 2) keeps radius and margin from all walls."""
        step = np.diff(points, axis=0)
        return bool(self.clear(points[:-1], step, margin_m).all())

    def touched(self, points: np.ndarray, margin_m: float) -> set[int]:
        """Numbers of the walls that a polyline (p, 2) does not keep radius and margin from."""
        if not self:
            return set()
        (x, y), (dx, dy) = points[:-1].T[:, :, None], np.diff(points, axis=0).T[:, :, None]
        distance = self.segments.swept_distances(x, y, dx, dy).min(axis=0)
        return set(np.flatnonzero(distance < self.radius_m + margin_m).tolist())

    def pulled(self, points: np.ndarray, margin_m: float) -> np.ndarray:
        """A polyline (p, 2) without the points that straight edges may leave out."""
        kept = [0]
        while kept[-1] < len(points) - 1:
            ahead = points[kept[-1] + 1 :]
            here = np.broadcast_to(points[kept[-1]], ahead.shape)
            free = np.flatnonzero(self.clear(here, ahead - here, margin_m))
            kept.append(kept[-1] + 1 + (int(free[-1]) if len(free) else 0))
        return points[kept]

    def clear_steps(
        self, points: np.ndarray, steps: np.ndarray, which: np.ndarray, margin_m: float
    ) -> np.ndarray:
        """clear() of steps (h, 2) from points (n, 2): of those numbered h * point + step."""
        if not self:
            return np.ones(len(which), dtype=bool)
        touched = np.zeros(len(points) * len(steps), dtype=bool)
        requested = np.zeros_like(touched)
        requested[which] = True
        reach_m = float(np.hypot(*steps[0])) + self.radius_m + margin_m + _SLACK_M
        for members, near_walls in self._blocks(points, reach_m):
            block = points[members]
            distance = near_walls.distances(block[:, :1], block[:, 1:])
            origin, wall = np.nonzero(distance <= reach_m)
            for j in range(0, len(origin), _PAIRS // len(steps)):
                pair = slice(j, j + _PAIRS // len(steps))
                start, near = origin[pair], near_walls.select(wall[pair])
                near = Segments(*(column[:, None] for column in near))
                x, y = block[start, :1], block[start, 1:]
                gap = near.swept_distances(x, y, steps[:, 0], steps[:, 1])
                number = members[start][:, None] * len(steps) + np.arange(len(steps))
                touched[number[gap < self.radius_m + margin_m]] = True
        free: np.ndarray = ~touched[which]
        return free

    def _blocks(self, points: np.ndarray, reach_m: float) -> Iterator[tuple[np.ndarray, Segments]]:
        """Numbers of points (n, 2) that are near each other, and the walls in reach of them."""
        cells = np.floor(points / _BLOCK_M).astype(np.int64)
        order = np.lexsort(cells.T)
        changes = np.flatnonzero(np.any(np.diff(cells[order], axis=0) != 0, axis=1)) + 1
        for members in np.split(order, changes):
            x, y = ((cells[members[0]] + 0.5) * _BLOCK_M).tolist()
            near = self.segments.near((x, y), reach_m + _BLOCK_M)
            if near.x.size:
                yield members, near


NO_WALLS = StaticWalls(Segments.of([]), 0.0)


class WallEnds:
    """The ends of all walls as obstacles at rest, numbered after those of the scenario."""

    def __init__(self, scenario: Scenario) -> None:
        """Ends that walls share count once."""
        s = scenario.segments
        starts, ends = np.stack([s.x, s.y], axis=1), np.stack([s.x + s.dx, s.y + s.dy], axis=1)
        self._first = len(scenario.obstacles)
        self._radius_m = scenario.robot_radius_m
        self._points, index = np.unique(
            np.round(np.concatenate([starts, ends]), 9), axis=0, return_inverse=True
        )
        self._of_walls = index.reshape(2, -1)

    def of_walls(self, walls: Iterable[int]) -> set[int]:
        """Obstacle numbers of the ends of some walls."""
        chosen = self._of_walls[:, sorted(walls)]
        return set((self._first + chosen).ravel().tolist())

    def added_to(self, segments: UniformSegments, until_s: float) -> UniformSegments:
        """The motion of all obstacles in [0, until_s], and the ends at rest."""
        count = len(self._points)
        still, until = np.zeros(count), np.full(count, until_s)
        radius = np.full(count, self._radius_m)
        x, y = self._points.T
        numbers = self._first + np.arange(count, dtype=np.intp)
        resting = (still, until, x, y, still, still, radius, numbers)
        return UniformSegments(*(np.concatenate(columns) for columns in zip(segments, resting)))
