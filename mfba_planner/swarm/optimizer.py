# SPDX-License-Identifier: Apache-2.0
"""The protocol of optimisers, and search(), which counts their evaluations from outside."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from numpy.random import Generator

from ..core.errors import InputError, MfbaError, OptimizerError, OutsideError
from .bat_swarm import BatSwarm
from .objective_failures import Evaluate, Failures, each
from .search_region import Region, Vector

Objective = Callable[[Sequence[float]], float]

__all__ = [
    "BudgetUsed", "Evaluate", "Factory", "Found", "Objective", "Optimizer", "RunOptimizer",
    "each", "raised", "search",
]  # fmt: skip

_EDGE = 1e-9  # of the region's width: clamp() rounds


class Optimizer(Protocol):
    """Minimizes by ask and tell; BatSwarm is one.

    tell() gets one float per point of the last ask(): lower is better, inf where the objective
    failed. Points lie inside the region.
    """

    @property
    def best_x(self) -> Vector:
        """The best point told so far; [] before the first."""

    @property
    def best_value(self) -> float:
        """Its value; inf before the first."""

    def ask(self) -> Sequence[Sequence[float]]:
        """Return one or more points; not more than the population is usual."""

    def tell(self, values: Sequence[float]) -> None:
        """Take the values of the last points."""


@runtime_checkable
class RunOptimizer(Protocol):
    """Minimizes by calling the objective; for libraries that offer nothing else.

    The objective raises BudgetUsed when the budget is used; run() need not catch it.
    """

    def run(self, objective: Objective) -> object:
        """Search until it ends by itself or by BudgetUsed."""


# Called with region, budget (evaluations), generator and population (points per ask()).
Factory = Callable[[Region, int, Generator, int], Optimizer | RunOptimizer]


class BudgetUsed(BaseException):
    """Ends the run() of a library; a BaseException, so that the library does not catch it."""


@dataclass(slots=True)
class Found:
    """The best point of a search, its last points, the number of evaluations, the failures."""

    best_x: Vector = field(default_factory=list)
    best_value: float = math.inf
    candidates: list[Vector] = field(default_factory=list)
    evaluations: int = 0
    failures: Failures = field(default_factory=Failures)

    def take(self, points: list[Vector], values: Sequence[Any]) -> Sequence[float]:
        """Count the values of points; return them as tell() gets them.

        A value that is not a finite number never becomes the best.
        """
        if len(values) != len(points):
            raise InputError(f"{len(values)} values for {len(points)} points: give one for each")
        try:
            total = sum(values)
        except Exception:  # a value is not a number
            total = None
        if type(total) is not float or total - total != 0.0:
            numbers = [self.failures.number(v, x) for v, x in zip(values, points)]
            values = [math.inf if v != v else v for v in numbers]
        least = min(values)
        if least < self.best_value:
            self.best_x, self.best_value = points[values.index(least)], least
        elif not self.best_x:
            self.best_x = points[0]
        self.candidates = points
        self.evaluations += len(points)
        return values


def search(
    optimizer: Optimizer | RunOptimizer, region: Region, budget: int, evaluate: Evaluate
) -> Found:
    """Let an optimiser search with at most so many evaluations; evaluate takes a list of points.

    The points of an ask() beyond the budget are left out. Raises OptimizerError for an optimiser
    that raises, that evaluates nothing, or whose points are not in the region.
    """
    if type(optimizer) is BatSwarm:
        return _bats(optimizer, budget, evaluate)
    if isinstance(optimizer, RunOptimizer):
        return _run(optimizer, region, budget, evaluate)
    found = Found()
    while (left := budget - found.evaluations) > 0:
        points = _asked(optimizer, region)
        values = found.take(points[:left], evaluate(points[:left]))
        if len(points) > left:
            break
        _call("tell()", optimizer.tell, values)
    return found


def _bats(swarm: BatSwarm, budget: int, evaluate: Evaluate) -> Found:
    """The same search: a swarm keeps its own best and failures, and is trusted with its region.

    With bounds=none it leaves the region on purpose.
    """
    whole, rest = divmod(budget, swarm.params.population)
    for _ in range(whole):
        swarm.tell(evaluate(swarm.ask()))
    found = Found(swarm.best_x, swarm.best_value, swarm.candidates, budget - rest, swarm.failures)
    if rest:
        points = swarm.ask()[:rest]
        found.take(points, evaluate(points))
    return found


def _run(optimizer: RunOptimizer, region: Region, budget: int, evaluate: Evaluate) -> Found:
    found, errors = Found(), list[Exception]()

    def objective(x: Sequence[float]) -> float:
        if errors or found.evaluations >= budget:
            raise BudgetUsed
        try:
            points = _inside([x], region)
            return found.take(points, evaluate(points))[0]
        except Exception as error:  # not the library's: it must not handle it
            errors.append(error)
            raise BudgetUsed from None

    with suppress(BudgetUsed):
        _call("run()", optimizer.run, objective)
    if errors:
        raise errors[0]
    if not found.evaluations:
        raise OptimizerError("run() ended without an evaluation")
    return found


def _asked(optimizer: Optimizer, region: Region) -> list[Vector]:
    points = _inside(_call("ask()", optimizer.ask), region)
    if not points:
        raise OptimizerError("ask() returned no points")
    return points


def _call(name: str, method: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a method; OptimizerError if it raises."""
    try:
        return method(*arguments)
    except MfbaError:
        raise
    except Exception as error:
        raise OptimizerError(raised(name, error)) from error


def raised(name: str, error: Exception) -> str:
    """One line on an exception of a method."""
    return f"{name} raised {type(error).__name__} ({' '.join(str(error).split())[:200]})"


def _inside(points: Any, region: Region) -> list[Vector]:
    """The points as lists of floats. Raises OptimizerError for one outside the region."""
    low, high = region.span()
    slack = [_EDGE * (b - a) for a, b in zip(low, high)]
    vectors = []
    try:
        for point in points:
            x = [float(v) for v in point]
            if len(x) != len(low):
                raise OptimizerError(f"a point of {len(x)} numbers; give {len(low)}")
            # NaN is outside too.
            if not all(abs(a - b) <= e for a, b, e in zip(x, region.clamp(x), slack)):
                shown = ", ".join(f"{v:.4g}" for v in x)
                raise OutsideError(f"the point ({shown}) is outside the region")
            vectors.append(x)
    except (TypeError, ValueError) as error:
        raise OptimizerError(
            f"{type(points).__name__} instead of points ({error}); give lists of numbers"
        ) from None
    return vectors
