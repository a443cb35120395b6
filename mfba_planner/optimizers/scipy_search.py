# SPDX-License-Identifier: Apache-2.0
"""scipy:differential_evolution."""

from __future__ import annotations

from numpy.random import Generator
from scipy.optimize import differential_evolution

from ..swarm.optimizer import Factory, Objective
from ..swarm.search_region import Region
from .box_objective import LibraryRun, unknown

NAMES = ("differential_evolution",)


def find(name: str) -> Factory:
    """The factory of an algorithm. Raises ConfigError for an unknown one."""
    if name not in NAMES:
        raise unknown("scipy", name, NAMES)
    return _make


def _make(region: Region, budget: int, generator: Generator, population: int) -> LibraryRun:
    bounds = list(zip(*region.span()))

    def start(objective: Objective) -> object:
        return differential_evolution(
            objective, bounds, maxiter=budget, popsize=max(1, round(population / len(bounds))),
            tol=0.0, seed=generator, polish=False, init="random",
        )  # fmt: skip

    return LibraryRun(region, start)
