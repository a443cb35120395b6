# SPDX-License-Identifier: Apache-2.0
"""mealpy:MODULE.NAME, such as mealpy:PSO.OriginalPSO, with its own defaults."""

from __future__ import annotations

from inspect import getmembers, isclass, ismodule

import mealpy
from numpy.random import Generator

from ..swarm.optimizer import Factory, Objective
from ..swarm.search_region import Region
from .box_objective import LibraryRun, seed_of, unknown


def names() -> list[str]:
    """Names of all algorithms."""
    return sorted(
        f"{module_name}.{name}"
        for module_name, module in getmembers(mealpy, ismodule)
        for name, kind in getmembers(module, isclass)
        if issubclass(kind, mealpy.Optimizer) and kind is not mealpy.Optimizer
        if kind.__module__ == module.__name__
    )


def find(name: str) -> Factory:
    """The factory of an algorithm. Raises ConfigError for an unknown one."""
    module_name, _, class_name = name.partition(".")
    if name not in names():
        raise unknown("mealpy", name, names())
    kind = getattr(getattr(mealpy, module_name), class_name)

    def make(region: Region, budget: int, generator: Generator, population: int) -> LibraryRun:
        low, high = region.span()

        def start(objective: Objective) -> None:
            problem = {
                "obj_func": objective,
                "bounds": mealpy.FloatVar(lb=low, ub=high),
                "minmax": "min",
                "log_to": None,
            }
            algorithm = kind(epoch=max(1, budget // population - 1), pop_size=population)
            algorithm.solve(problem, seed=seed_of(generator))

        return LibraryRun(region, start)

    return make
