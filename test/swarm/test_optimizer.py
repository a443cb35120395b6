# SPDX-License-Identifier: Apache-2.0
"""search(): the budget, failures and faults of optimisers; the bats as one of them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import faulty_optimizers as faulty
import pytest
from any_bat_params import ANY_READING
from hypothesis import given
from hypothesis import strategies as st
from numpy.random import PCG64, Generator

from mfba_planner.core.errors import InputError, OptimizerError, OutsideError
from mfba_planner.swarm.bat_swarm import BatParams, BatSwarm, Box, Disc, minimize
from mfba_planner.swarm.optimizer import Optimizer, each, search
from mfba_planner.swarm.search_region import Region, Vector

DISC = Disc(0.3, (1.0, -2.0))
BOX = Box((-1.0, 0.0, 2.0), (1.0, 3.0, 2.5))


def rng(seed: int = 0) -> Generator:
    return Generator(PCG64(seed))


def sphere(x: Sequence[float]) -> float:
    return math.fsum((v - 0.3) ** 2 for v in x)


def partly(x: Vector) -> Any:
    """Fails in three of four quarters, each in another way."""
    if x[0] > 1.0:
        return math.nan if x[1] > -2.0 else math.inf
    if x[1] > -2.0:
        raise ValueError("no value")
    return sphere(x)


class AskedInTurn:
    """An optimiser behind the protocol alone: search() cannot know what it is."""

    def __init__(self, inner: Optimizer) -> None:
        self.inner, self.received = inner, list[Sequence[float]]()

    @property
    def best_x(self) -> Vector:
        return self.inner.best_x

    @property
    def best_value(self) -> float:
        return self.inner.best_value

    def ask(self) -> Sequence[Sequence[float]]:
        return self.inner.ask()

    def tell(self, values: Sequence[float]) -> None:
        self.received.append(values)
        self.inner.tell(values)


@pytest.mark.parametrize("objective", [sphere, partly])
@given(bat=ANY_READING, seed=st.integers(0, 99))
def test_bats_search_as_minimize_does_bit_by_bit(
    objective: Callable[[Vector], float], bat: BatParams, seed: int
) -> None:
    plain = minimize(sphere, DISC, bat, rng(seed))
    if objective is partly:
        try:
            plain = minimize(partly, DISC, bat, rng(seed))
        except InputError:  # as there is no planner's objective that fails everywhere
            return
    swarm = BatSwarm(bat, DISC, rng(seed), ahead=bat.iterations)
    found = search(swarm, DISC, bat.population * (bat.iterations + 1), each(objective))
    assert (found.best_x, found.best_value) == (plain.best_x, plain.best_value)
    assert found.candidates == plain.candidates
    assert found.failures == plain.failures
    assert found.evaluations == bat.population * (bat.iterations + 1)


@given(seed=st.integers(0, 99), iterations=st.integers(1, 9), d=st.sampled_from([DISC, BOX]))
def test_bats_are_an_optimizer_like_any_other(seed: int, iterations: int, d: Region) -> None:
    bat = BatParams(iterations=iterations)
    budget = bat.population * (iterations + 1)
    known = search(BatSwarm(bat, d, rng(seed)), d, budget, each(sphere))
    asked = search(AskedInTurn(BatSwarm(bat, d, rng(seed))), d, budget, each(sphere))
    assert known == asked


@given(budget=st.integers(1, 60), population=st.integers(1, 20), seed=st.integers(0, 9))
def test_the_budget_is_used_and_never_exceeded(budget: int, population: int, seed: int) -> None:
    kinds: list[Any] = [faulty.Sound, faulty.Runs]
    swarm = BatSwarm(BatParams(population=population + 1), DISC, rng(seed))
    for made in [*(kind(DISC, budget, rng(seed), population) for kind in kinds), swarm]:
        values: list[float] = []

        def evaluate(points: list[Vector], values: list[float] = values) -> list[float]:
            values += map(sphere, points)
            return values[-len(points) :]

        found = search(made, DISC, budget, evaluate)
        assert len(values) == found.evaluations == budget
        assert found.best_value == min(values) == sphere(found.best_x)


def test_points_beyond_the_budget_are_left_out_and_not_passed_on() -> None:
    asked = AskedInTurn(faulty.Sound(DISC, 8, rng(), 5))
    found = search(asked, DISC, 8, each(sphere))
    assert [len(values) for values in asked.received] == [5]
    assert len(found.candidates) == 3


def test_a_failed_value_is_passed_on_as_inf_counted_and_never_the_best() -> None:
    asked = AskedInTurn(faulty.Sound(DISC, 200, rng(), 5))
    found = search(asked, DISC, 200, each(partly))
    received = [value for values in asked.received for value in values]
    assert all(value == math.inf or math.isfinite(value) for value in received)
    assert set(found.failures.counts) == {"NaN", "inf", "raised ValueError"}
    assert sum(found.failures.counts.values()) == received.count(math.inf)
    assert found.best_value == min(received) < math.inf
    runs = search(faulty.Runs(DISC, 200, rng(), 5), DISC, 200, each(partly))
    assert runs.failures.counts.keys() == found.failures.counts.keys()
    assert runs.best_value < math.inf


@pytest.mark.parametrize("kind", [faulty.Sound, faulty.Runs, BatSwarm])
def test_a_failing_objective_is_not_called_more_often(kind: Any) -> None:
    calls = []

    def counted(x: Vector) -> Any:
        calls.append(x)
        return partly(x)

    made = kind(DISC, 30, rng(), 5) if kind is not BatSwarm else BatSwarm(BatParams(), DISC, rng())
    found = search(made, DISC, 30, each(counted))
    assert found.failures
    assert len(calls) == found.evaluations == 30


def test_without_any_value_the_first_point_is_the_best() -> None:
    asked = AskedInTurn(faulty.Sound(DISC, 10, rng(), 5))
    found = search(asked, DISC, 10, lambda points: [None] * len(points))
    assert found.best_x == faulty.Sound(DISC, 10, rng(), 5).ask()[0]
    assert found.best_value == math.inf
    assert found.failures.broken == 10


@pytest.mark.parametrize(
    ("kind", "error", "message"),
    [
        (faulty.RaisesInAsk, OptimizerError, r"^ask\(\) raised ValueError \(no idea where\)$"),
        (faulty.RaisesInTell, OptimizerError, r"^tell\(\) raised ZeroDivisionError"),
        (faulty.NoPoints, OptimizerError, r"^ask\(\) returned no points$"),
        (faulty.Outside, OutsideError, r"^the point \(3, 3\) is outside the region$"),
        (faulty.NotANumber, OutsideError, r"^the point \(nan, 0\) is outside the region$"),
        (faulty.ThreeNumbers, OptimizerError, "^a point of 3 numbers; give 2$"),
        (faulty.Text, OptimizerError, "give lists of numbers$"),
        (faulty.RunsNever, OptimizerError, r"^run\(\) ended without an evaluation$"),
    ],
)
def test_a_faulty_optimizer_is_an_error_in_one_line(
    kind: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        search(kind(DISC, 30, rng(), 5), DISC, 30, each(sphere))


@pytest.mark.parametrize("kind", [faulty.Sound, faulty.Runs])
def test_an_error_of_the_caller_is_not_the_optimizer_s(kind: Any) -> None:
    def evaluate(points: list[Vector]) -> list[float]:
        raise KeyError("a fault in a planner")

    with pytest.raises(KeyError, match="a fault in a planner"):
        search(kind(DISC, 30, rng(), 5), DISC, 30, evaluate)
    with pytest.raises(InputError, match=r"^0 values for \d points: give one for each$"):
        search(kind(DISC, 30, rng(), 5), DISC, 30, lambda points: [])


def test_points_on_the_edge_are_inside_whatever_clamp_rounds() -> None:
    class Edge(faulty.Sound):
        def point(self) -> Any:
            angle = 2.0 * math.pi * self.draw()
            x = 1.0 + 0.3 * math.cos(angle), -2.0 + 0.3 * math.sin(angle)
            return x if math.dist(x, DISC.center) != 0.3 else self.point()

    found = search(Edge(DISC, 500, rng(), 50), DISC, 500, each(sphere))
    assert math.dist(found.best_x, DISC.center) == pytest.approx(0.3)


@pytest.mark.parametrize("beyond", [(1e-6, 0.0, 0.0), (0.0, 0.0, -1e-6), (0.0, math.nan, 0.0)])
def test_a_point_beyond_one_edge_is_outside(beyond: tuple[float, ...]) -> None:
    class Beyond(faulty.Sound):
        def point(self) -> Any:
            return [a + b for a, b in zip((1.0, 1.0, 2.0), beyond)]

    with pytest.raises(OutsideError, match="is outside the region"):
        search(Beyond(BOX, 30, rng(), 5), BOX, 30, each(sphere))


def test_an_iteration_more_or_less_is_another_search() -> None:
    """The budget reaches the bats: the digest of case studies does not hide it."""
    bat = BatParams()
    one, two = (
        search(BatSwarm(replace(bat), DISC, rng()), DISC, n, each(sphere)) for n in (25, 30)
    )
    assert (one.evaluations, two.evaluations) == (25, 30)
    assert one.candidates != two.candidates
