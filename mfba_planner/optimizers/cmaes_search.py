# SPDX-License-Identifier: Apache-2.0
"""cmaes:CMA, in the unit cube; it starts again where its own criteria end it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from cmaes import CMA
from numpy.random import Generator

from ..swarm.optimizer import Factory
from ..swarm.search_region import Region, Vector
from .box_objective import from_box, seed_of, unknown

SIGMA = 0.3  # of the cube's side: the usual start
LEAST = 4  # points of a generation


def find(name: str) -> Factory:
    """The factory of an algorithm. Raises ConfigError for an unknown one."""
    if name != "CMA":
        raise unknown("cmaes", name, ["CMA"])
    return _CmaEs


class _CmaEs:
    def __init__(self, region: Region, budget: int, generator: Generator, population: int) -> None:
        self.best_x: Vector = []
        self.best_value = math.inf
        self._region, self._generator = region, generator
        self._population = max(population, LEAST)
        self._restart()

    def ask(self) -> list[Vector]:
        low, high = self._region.span()
        self._asked = [self._cma.ask() for _ in range(self._population)]
        self._points = [
            from_box(self._region, [a + u * (b - a) for u, a, b in zip(x, low, high)])
            for x in self._asked
        ]
        return self._points

    def tell(self, values: Sequence[float]) -> None:
        least = min(values)
        if least < self.best_value:
            self.best_x, self.best_value = self._points[list(values).index(least)], least
        self._cma.tell(list(zip(self._asked, values)))
        if self._cma.should_stop():
            self._restart()

    def _restart(self) -> None:
        d = len(self._region.span()[0])
        cube = np.array([[0.0, 1.0]] * d)
        self._cma = CMA(
            np.full(d, 0.5), SIGMA, cube, seed=seed_of(self._generator),
            population_size=self._population,
        )  # fmt: skip
