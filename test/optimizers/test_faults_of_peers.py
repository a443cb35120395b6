# SPDX-License-Identifier: Apache-2.0
"""Faults of other libraries' bat algorithms, shown with the installed libraries."""

from typing import Any

import numpy as np
import pytest
from numpy.random import PCG64, Generator


def bowl(x: Any) -> float:
    return float(np.sum(np.square(x)))


def test_velocities_of_mealpys_original_bat_algorithm_never_change() -> None:
    """Its new velocity goes into a copy of the bat, of which position and value are kept."""
    mealpy = pytest.importorskip("mealpy")
    velocities, positions = [], []

    class Observed(mealpy.BA.OriginalBA):  # type: ignore[misc, name-defined]
        def evolve(self, epoch: int) -> None:
            super().evolve(epoch)
            velocities.append(np.array([bat.velocity for bat in self.pop]))
            positions.append(np.array([bat.solution for bat in self.pop]))

    bounds = mealpy.FloatVar(lb=(-10.0,) * 2, ub=(10.0,) * 2)
    problem = {"bounds": bounds, "obj_func": bowl, "minmax": "min", "log_to": None}
    Observed(epoch=100, pop_size=10).solve(problem, seed=1)
    assert len(velocities) == 100
    assert abs(velocities[0]).min() > 0.0
    assert all((v == velocities[0]).all() for v in velocities)
    assert (positions[0] != positions[-1]).any()
    # Those that Yang's eq. 3 gives would change at once: no bat but one is at the best point.
    best = positions[0][np.argmin([bowl(x) for x in positions[0]])]
    assert np.count_nonzero((positions[0] != best).any(axis=1)) >= 9


@pytest.mark.parametrize(("loudness", "accepted"), [(0.05, True), (1.0, False)])
def test_niapys_bat_algorithm_accepts_inverted(loudness: float, accepted: bool) -> None:
    """Yang accepts a better point if rand < A: a loud bat always does. There it never does."""
    pytest.importorskip("niapy")
    from niapy.algorithms.basic import BatAlgorithm
    from niapy.problems import Sphere
    from niapy.task import Task

    algorithm = BatAlgorithm(
        population_size=10, loudness=loudness, alpha=1.0, seed=Generator(PCG64(1))
    )
    task = Task(problem=Sphere(2), max_iters=50)
    start, values, more = algorithm.init_population(task)
    x, fitness, best = start.copy(), values.copy(), float(values.min())
    best_x = start[values.argmin()].copy()
    for _ in range(50):
        x, fitness, best_x, best, more = algorithm.run_iteration(
            task, x, fitness, best_x, best, **more
        )
        task.next_iter()
    assert best < values.min()  # better points were found, by both
    assert bool((x != start).any()) is accepted
