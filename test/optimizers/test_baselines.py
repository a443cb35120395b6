# SPDX-License-Identifier: Apache-2.0
"""Random search is uniform, the grid even; both are inside any region."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.random import PCG64, Generator

from mfba_planner.optimizers.baselines import Grid, RandomSearch, grid_points, uniform_point
from mfba_planner.swarm.optimizer import Optimizer, each, search
from mfba_planner.swarm.search_region import Box, Disc, Region, Vector

DISC = Disc(2.0, (10.0, -5.0))
SIDES = st.tuples(st.floats(-9.0, 9.0), st.floats(0.0, 5.0))
BOXES = st.lists(SIDES, min_size=1, max_size=3).map(
    lambda sides: Box(tuple(a for a, _ in sides), tuple(a + w for a, w in sides))
)
DISCS = st.builds(Disc, st.floats(0.0, 3.0), st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)))


class Narrow(Disc):
    """Nothing is inside but what clamp() returns."""

    def clamp(self, x: Vector) -> Vector:
        return [0.5, 0.5 + 0.0 * x[1]]


NARROW = Narrow(1e-30, (0.5, 0.5))


def rng(seed: int = 0) -> Generator:
    return Generator(PCG64(seed))


def evaluated(made: Optimizer, region: Region, budget: int) -> list[Vector]:
    points: list[Vector] = []

    def evaluate(asked: list[Vector]) -> list[float]:
        points.extend(asked)
        return [sum(x) for x in asked]

    search(made, region, budget, evaluate)
    return points


@given(region=st.one_of(BOXES, DISCS), budget=st.integers(1, 90), population=st.integers(1, 9))
def test_points_are_inside_and_as_many_as_the_budget(
    region: Region, budget: int, population: int
) -> None:
    for kind in (RandomSearch, Grid):
        made = kind(region, budget, rng(), population)
        points = evaluated(made, region, budget)
        assert len(points) == budget
        assert all(region.clamp(x) == x for x in points)


def test_a_region_without_interior_is_a_point() -> None:
    for kind in (RandomSearch, Grid):
        found = search(kind(NARROW, 9, rng(), 3), NARROW, 9, each(sum))
        assert found.best_x == [0.5, 0.5]


def test_random_points_are_uniform_in_the_disc() -> None:
    generator = rng(5)
    x = np.array([uniform_point(DISC, generator) for _ in range(4000)]) - DISC.center
    away = np.hypot(*x.T) / DISC.radius
    shares, _ = np.histogram(away**2, bins=10, range=(0.0, 1.0))
    assert np.allclose(shares, 400, atol=90), "equal areas, equal numbers (4.7 sigma)"
    quarters, _ = np.histogram(np.arctan2(*x.T), bins=4, range=(-math.pi, math.pi))
    assert np.allclose(quarters, 1000, atol=130)


@pytest.mark.parametrize(
    ("region", "budget", "number"),
    [
        (Box((0.0, 0.0), (1.0, 2.0)), 30, 25),
        (Box((0.0, 0.0), (1.0, 2.0)), 36, 36),
        (DISC, 30, 21),
        (DISC, 32, 32),
        (DISC, 1, 1),
    ],
)
def test_the_grid_is_the_finest_of_the_budget(region: Region, budget: int, number: int) -> None:
    more = [len(grid_points(region, k)) for k in range(1, 9)]
    assert number == max(n for n in more if n <= budget)
    points = [tuple(x) for x in Grid(region, budget, rng(), budget).ask()]
    assert len(points) == len(set(points)) == number <= budget
    steps = np.unique(np.round(np.diff(np.unique(np.array(points)[:, 0])), 9))
    assert len(steps) == 1 or number == 1


def test_both_find_the_minimum_of_a_bowl_roughly() -> None:
    for kind in (RandomSearch, Grid):
        found = search(
            kind(DISC, 400, rng(), 10), DISC, 400, each(lambda x: math.dist(x, (9.5, -4.2)))
        )
        assert found.best_value < 0.25
        made = kind(DISC, 40, rng(), 7)
        found = search(made, DISC, 40, each(sum))
        assert (made.best_x, made.best_value) == (found.best_x, found.best_value)
