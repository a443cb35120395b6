# SPDX-License-Identifier: Apache-2.0
"""Search without learning: uniform random points, and a fixed grid."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from numpy.random import Generator

from ..swarm.search_region import Region, Vector

_TRIES = 1000  # draws for a point inside a thin region


class _Points:
    """Asks for points that do not depend on values."""

    def __init__(self, points: list[Vector], batch: int) -> None:
        self.best_x: Vector = []
        self.best_value = math.inf
        self._points, self._batch, self._next = points, batch, 0

    def ask(self) -> list[Vector]:
        """The next points; the same again before tell(), and the first after the last."""
        return self._points[self._next : self._next + self._batch]

    def tell(self, values: Sequence[float]) -> None:
        """Keep the best."""
        for x, value in zip(self.ask(), values):
            if value < self.best_value:
                self.best_x, self.best_value = x, value
        self._next += self._batch
        if self._next >= len(self._points):
            self._next = 0


class RandomSearch(_Points):
    """Points drawn uniformly from the region."""

    def __init__(self, region: Region, budget: int, generator: Generator, population: int) -> None:
        """Draw all points."""
        points = [uniform_point(region, generator) for _ in range(budget)]
        super().__init__(points, population)


class Grid(_Points):
    """The same points for every seed: the middles of equal cells, without those outside."""

    deterministic = True

    def __init__(self, region: Region, budget: int, generator: Generator, population: int) -> None:
        """Choose the finest grid of at most budget points inside."""
        per_axis = math.floor(budget ** (1.0 / len(region.span()[0])) + 1e-9)
        points = grid_points(region, per_axis)
        # Of a region without interior every grid is one point.
        while per_axis < budget and len(finer := grid_points(region, per_axis + 1)) <= budget:
            points, per_axis = finer, per_axis + 1
        super().__init__(points, population)


def grid_points(region: Region, per_axis: int) -> list[Vector]:
    """The middles of per_axis cells in each dimension that are inside the region."""
    low, high = region.span()
    shares = [(k + 0.5) / per_axis for k in range(per_axis)]
    axes = [[a + share * (b - a) for share in shares] for a, b in zip(low, high)]
    every = [list(x) for x in itertools.product(*axes)]
    return [x for x in every if region.clamp(x) == x] or [region.clamp(every[0])]


def uniform_point(region: Region, generator: Generator) -> Vector:
    """A point drawn uniformly from the region."""
    low, high = region.span()
    for _ in range(_TRIES):
        x = [a + u * (b - a) for u, a, b in zip(generator.random(len(low)).tolist(), low, high)]
        if region.clamp(x) == x:
            return x
    return region.clamp(x)
