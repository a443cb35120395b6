# SPDX-License-Identifier: Apache-2.0
"""A sound optimiser, and some with one fault each."""

import math
import random
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random import Generator

from mfba_planner.swarm.optimizer import Objective
from mfba_planner.swarm.search_region import Region, Vector


class Sound:
    """Points between the best one and a random one."""

    def __init__(self, region: Region, budget: int, generator: Generator, population: int) -> None:
        self.region, self.generator, self.population = region, generator, population
        self.budget = budget
        self.best_x: Vector = []
        self.best_value = math.inf
        self.asked: list[Any] = []

    def draw(self) -> float:
        return float(self.generator.random())

    def point(self) -> Any:
        x = [a + self.draw() * (b - a) for a, b in zip(*self.region.span())]
        if self.best_x:
            x = [0.5 * (a + b) for a, b in zip(x, self.best_x)]
        return self.region.clamp(x)

    def ask(self) -> Any:
        self.asked = [self.point() for _ in range(self.population)]
        return self.asked

    def tell(self, values: Sequence[float]) -> None:
        for x, value in zip(self.asked, values):
            if value < self.best_value:
                self.best_x, self.best_value = x, value


class CannotBeMade(Sound):
    def __init__(self, *_: Any) -> None:
        raise TypeError("no idea\nhow")


class RaisesInAsk(Sound):
    def ask(self) -> Any:
        raise ValueError("no idea\nwhere")


class RaisesInTell(Sound):
    def tell(self, values: Sequence[float]) -> None:
        raise ZeroDivisionError("mean of nothing")


class NoPoints(Sound):
    def ask(self) -> Any:
        return []


class TooMany(Sound):
    """A population that its budget does not hold."""

    def __init__(self, region: Region, budget: int, generator: Generator, _: int) -> None:
        super().__init__(region, budget, generator, 50)


class Outside(Sound):
    def point(self) -> Any:
        return [3.0, 3.0]


class NotANumber(Sound):
    def point(self) -> Any:
        return [math.nan, 0.0]


class ThreeNumbers(Sound):
    def point(self) -> Any:
        return [*super().point(), 0.0]


class Text(Sound):
    def point(self) -> Any:
        return "north"


class Endless(Sound):
    def ask(self) -> Any:
        while True:
            self.draw()


class Unseeded(Sound):
    """Draws its own numbers."""

    def draw(self) -> float:
        return float(np.random.default_rng().random())


class OneSeed(Sound):
    """Starts a generator of its own from a fixed seed."""

    def __init__(self, region: Region, budget: int, _: Generator, population: int) -> None:
        super().__init__(region, budget, np.random.default_rng(7), population)


class GlobalNumpy(Sound):
    """Same points for a seed, but it seeds and draws from numpy's global generator."""

    def __init__(self, region: Region, budget: int, generator: Generator, population: int) -> None:
        super().__init__(region, budget, generator, population)
        np.random.seed(int(generator.integers(1000)))  # noqa: NPY002

    def draw(self) -> float:
        return float(np.random.random())  # noqa: NPY002


class GlobalPython(Sound):
    """The same with Python's."""

    def __init__(self, region: Region, budget: int, generator: Generator, population: int) -> None:
        super().__init__(region, budget, generator, population)
        random.seed(int(generator.integers(1000)))

    def draw(self) -> float:
        return random.random()


class HashSeed(Sound):
    """Its draws depend on the hash of a text."""

    def draw(self) -> float:
        return (super().draw() + hash("bat") % 1000 / 1000.0) % 1.0


class TrustsValues(Sound):
    """Does not expect inf."""

    def tell(self, values: Sequence[float]) -> None:
        super().tell(values)
        round(max(values))


class WrongBest(Sound):
    """Keeps the worst."""

    def tell(self, values: Sequence[float]) -> None:
        super().tell(values)
        self.best_value = max(values)


class Runs(Sound):
    """Sound, but offers only run(); it never stops by itself."""

    def run(self, objective: Objective) -> None:
        while True:
            x = self.point()
            self.asked = [x]
            self.tell([objective(x)])


class RunsAFew(Sound):
    """Ends before its budget."""

    def run(self, objective: Objective) -> None:
        for _ in range(3):
            objective(self.point())


class RunsNever(Sound):
    def run(self, objective: Objective) -> None:
        """No evaluation."""


class CatchesAll(Sound):
    """Goes on when the budget is used."""

    def run(self, objective: Objective) -> None:
        while True:
            try:
                objective(self.point())
            except (Exception, KeyboardInterrupt):
                continue
            except BaseException as error:
                if type(error).__name__ == "BudgetUsed":
                    continue
                raise
