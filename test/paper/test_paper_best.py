# SPDX-License-Identifier: Apache-2.0
"""The preset `best` compared with other optimisers (bench/peers.py) at the same budget."""

import numpy as np
import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.paper import readings_of_paper
from mfba_planner.paper.benchmark_functions import FUNCTIONS
from mfba_planner.swarm.bat_swarm import BatParams
from mfba_planner.swarm.batched_swarms import minimize_batch

# Means of F1-F6, population 40, 200 iterations, d = 2.
OTHERS = {
    "niapy BA": (1.5e-10, -0.020, 0.10, 3.9e-10, 3.10, -1.69),
    "mealpy DevBA": (7.9e-6, -0.995, 9e-6, 1.4e-4, 0.38, -1.78),
    "random search": (0.0042, -0.28, 0.0051, 0.049, 0.63, -1.79),
}
RUNS = 120


def means(params: BatParams) -> list[float]:
    """Mean best value of F1-F6."""
    found = []
    for function in FUNCTIONS.values():
        rngs = [np.random.Generator(np.random.PCG64(seed)) for seed in range(RUNS)]
        found.append(
            float(minimize_batch(function.batch, function.box(), params, rngs).best_value.mean())
        )
    return found


@pytest.fixture(scope="module")
def best() -> list[float]:
    return means(readings_of_paper.swarm("best"))


@pytest.mark.parametrize("name", OTHERS)
def test_best_has_the_lower_mean_on_at_least_five_of_six(name: str, best: list[float]) -> None:
    won = [ours < theirs for ours, theirs in zip(best, OTHERS[name])]
    assert sum(won) >= 5, (best, OTHERS[name])


def test_best_reaches_the_minimum_of_each_function(best: list[float]) -> None:
    for function, mean in zip(FUNCTIONS.values(), best):
        assert mean - function.minimum() < 0.02, function.key


def test_best_has_the_budget_of_the_others() -> None:
    params = readings_of_paper.swarm("best")
    assert (params.population, params.iterations) == (40, 200)


def test_a_misspelt_reading_gets_a_suggestion() -> None:
    with pytest.raises(ConfigError, match=r"^'bets': unknown swarm reading; did you mean 'best'"):
        readings_of_paper.swarm("bets")
