# SPDX-License-Identifier: Apache-2.0
"""Batched swarms: every run equals the single swarm bit by bit; errors and failures."""

import math
from dataclasses import replace

import numpy as np
import pytest
from any_bat_params import ANY_READING
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import InputError
from mfba_planner.swarm import batched_swarms
from mfba_planner.swarm.bat_swarm import (
    Algorithm,
    BatParams,
    BatSwarm,
    Box,
    Disc,
    Vector,
    Walk,
    minimize,
)
from mfba_planner.swarm.batched_swarms import minimize_batch

BOX = Box((-1.0, -2.0), (3.0, 0.5))
BOXES = st.lists(
    st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0)), min_size=1, max_size=4
).map(lambda sides: Box(*zip(*map(sorted, sides))))  # type: ignore[arg-type]


DISCS = st.builds(
    Disc, st.floats(0.001, 9.0), st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
)


def generators(runs: int, seed: int = 7) -> list[np.random.Generator]:
    children = np.random.SeedSequence(seed).spawn(runs)
    return [np.random.Generator(np.random.PCG64(child)) for child in children]


def bowl(x: Vector) -> float:
    """NaN in a corner, -inf in another, inf on a side, two valleys."""
    if x[0] > 0.9 and x[-1] > 0.2:
        return math.nan
    if x[0] > 0.9 and x[-1] < -1.5:
        return -math.inf
    total = 0.0
    for v in x:
        total = total + (v * v - 0.3) * (v * v - 0.3) + 0.1 * v
    return total if x[0] > -0.9 else math.inf


def bowls(x: np.ndarray) -> np.ndarray:
    total = np.zeros(x.shape[:-1])
    with np.errstate(over="ignore", invalid="ignore"):
        for j in range(x.shape[-1]):
            v = x[..., j]
            total = total + (v * v - 0.3) * (v * v - 0.3) + 0.1 * v
    total = np.where(x[..., 0] > -0.9, total, math.inf)
    total = np.where((x[..., 0] > 0.9) & (x[..., -1] < -1.5), -math.inf, total)
    return np.where((x[..., 0] > 0.9) & (x[..., -1] > 0.2), math.nan, total)


@given(ANY_READING, BOXES | DISCS, st.integers(0, 2**32), st.integers(1, 5))
def test_each_run_equals_the_single_engine_bit_by_bit(
    p: BatParams, region: Box | Disc, seed: int, runs: int
) -> None:
    ours, theirs = generators(runs, seed), generators(runs, seed)
    result = minimize_batch(bowls, region, p, ours)
    for i, rng in enumerate(theirs):
        swarm = BatSwarm(p, region, rng)
        for t in range(p.iterations + 1):
            swarm.tell([bowl(x) for x in swarm.ask()])
            assert result.history[i, t] == swarm.best_value
        assert result.best_value[i] == swarm.best_value
        assert result.failures[i] == sum(swarm.failures.counts.values())
        assert result.best_x[i].tobytes() == np.array(swarm.best_x).tobytes()
        assert ours[i].random() == rng.random(), "both took the same number of draws"


@pytest.mark.parametrize("a0", [1e-7, 0.3, 2.0, 100.0])
def test_any_loudness_gives_the_same_walk_as_the_single_engine(a0: float) -> None:
    p = BatParams(a0=a0, sigma=0.05 / a0, r0=0.0, iterations=9)
    result = minimize_batch(bowls, BOX, p, generators(4))
    for i, rng in enumerate(generators(4)):
        assert result.best_x[i].tolist() == minimize(bowl, BOX, p, rng).best_x


def test_runs_in_chunks_are_the_same_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    p = BatParams(population=8, iterations=40, f_max=1.5)
    unsplit = minimize_batch(bowls, BOX, p, generators(9))
    monkeypatch.setattr(batched_swarms, "CACHED_BATS", 16)  # two runs at once
    monkeypatch.setattr(batched_swarms, "DRAWN", 500)  # six iterations drawn at once
    chunks = minimize_batch(bowls, BOX, p, generators(9))
    for name in ("best_value", "best_x", "history", "failures"):
        assert np.array_equal(getattr(unsplit, name), getattr(chunks, name)), name
    swarm = minimize(bowl, BOX, p, generators(9)[8])
    assert (swarm.best_value, swarm.best_x) == (unsplit.best_value[8], unsplit.best_x[8].tolist())


def test_history_falls_to_the_best_value() -> None:
    result = minimize_batch(bowls, BOX, BatParams(iterations=30), generators(20))
    assert result.history.shape == (20, 31)
    assert (np.diff(result.history, axis=1) <= 0.0).all()
    assert np.array_equal(result.history[:, -1], result.best_value)
    assert np.array_equal(bowls(result.best_x), result.best_value)


def test_no_generators_no_runs() -> None:
    result = minimize_batch(bowls, BOX, BatParams(), [])
    assert result.best_value.shape == (0,)
    assert result.best_x.shape == (0, 2)


def test_failures_are_counted_per_run() -> None:
    p = BatParams(population=3, iterations=4)
    result = minimize_batch(lambda x: np.full(x.shape[:-1], math.nan), BOX, p, generators(2))
    assert result.failures.tolist() == [15, 15]
    assert result.best_value.tolist() == [math.inf, math.inf]
    assert minimize_batch(lambda x: x[..., 0], BOX, p, generators(2)).failures.tolist() == [0, 0]


def test_an_objective_of_the_wrong_shape_is_refused() -> None:
    with pytest.raises(InputError, match=r"^objective returned shape \(2, 5, 2\) for points"):
        minimize_batch(lambda x: x, BOX, BatParams(), generators(2))
    with pytest.raises(InputError, match=r"^objective returned shape \(\) for points"):
        minimize_batch(lambda x: np.array(1.0), BOX, BatParams(), generators(2))


def test_an_objective_that_raises_is_named() -> None:
    def broken(x: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError("no value")

    with pytest.raises(InputError, match=r"^objective raised ZeroDivisionError \(no value\) at"):
        minimize_batch(broken, BOX, BatParams(), generators(2))


def test_the_readings_differ_in_the_batched_engine_too() -> None:
    best = set()
    for changes in ({}, {"algorithm": Algorithm.BA}, {"walk": Walk.SELF}, {"sigma": 0.1}):
        p = replace(BatParams(iterations=20), **changes)  # type: ignore[arg-type]
        best.add(minimize_batch(bowls, BOX, p, generators(3)).best_value.tobytes())
    assert len(best) == 4
