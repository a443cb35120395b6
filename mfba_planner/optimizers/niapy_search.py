# SPDX-License-Identifier: Apache-2.0
"""niapy:NAME, such as niapy:ParticleSwarmAlgorithm, with its own defaults."""

from __future__ import annotations

from inspect import isclass
from typing import Any

import numpy as np
from niapy import algorithms
from niapy.problems import Problem
from niapy.task import Task
from numpy.random import Generator

from ..swarm.optimizer import BudgetUsed, Factory, Objective
from ..swarm.search_region import Region
from .box_objective import LibraryRun, unknown


def names() -> list[str]:
    """Names of all algorithms."""
    return sorted(_kinds())


def find(name: str) -> Factory:
    """The factory of an algorithm. Raises ConfigError for an unknown one."""
    if name not in (kinds := _kinds()):
        raise unknown("niapy", name, names())
    kind = kinds[name]

    def make(region: Region, budget: int, generator: Generator, population: int) -> LibraryRun:
        def start(objective: Objective) -> None:
            task = Task(problem=_Problem(region, objective), max_evals=budget)
            algorithm = kind(population_size=population, seed=generator)
            algorithm.run(task)
            # In a child process run() keeps its exception to itself.
            error = algorithm.exception
            if error is not None and not isinstance(error, BudgetUsed):
                raise error

        return LibraryRun(region, start)

    return make


def _kinds() -> dict[str, Any]:
    groups = (algorithms.basic, algorithms.modified, algorithms.other)
    found = {name: getattr(group, name) for group in groups for name in group.__all__}
    return {
        name: kind
        for name, kind in found.items()
        if isclass(kind) and issubclass(kind, algorithms.Algorithm)
    }


class _Problem(Problem):
    def __init__(self, region: Region, objective: Objective) -> None:
        low, high = region.span()
        super().__init__(len(low), np.array(low), np.array(high))
        self._objective = objective

    def _evaluate(self, x: Any) -> float:
        return self._objective(x)
