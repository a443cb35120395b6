# SPDX-License-Identifier: Apache-2.0
"""Our swarm beside niapy's and mealpy's bat algorithms and random search, on F1-F6 of Table 2.

    pip install -e .[optimizers]
    python bench/peers.py                 # some ten minutes, nearly all of them the peers'
    python bench/peers.py --peer-runs 10  # fewer runs

Budget: the same number of evaluations for all, population 40 and 200 iterations in d = 2 (only
the best of a peer's first 8040 evaluations counts). Run k of everyone has seed k. Speed: a plain
sphere, all in turn (A B C A B C ...) in one process, so that the ratios hold where the clock
does not.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import math
import platform
import statistics
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from mealpy import BA, FloatVar
from niapy.algorithms.basic import BatAlgorithm
from niapy.problems import Problem
from niapy.task import Task
from numpy.random import PCG64, Generator

from mfba_planner.paper.benchmark_functions import FUNCTIONS, Function
from mfba_planner.paper.readings_of_paper import SWARMS
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams, minimize
from mfba_planner.swarm.batched_swarms import minimize_batch
from mfba_planner.swarm.search_region import Box

Array = np.ndarray
POPULATION, ITERATIONS, DIMENSION = 40, 200, 2
EVALUATIONS = POPULATION * (ITERATIONS + 1)
SUCCESS = 1e-4  # distance from the minimum


class Counted:
    """An objective for arrays that remembers the best of its first so many evaluations."""

    def __init__(self, function: Callable[[Sequence[float]], float], limit: int) -> None:
        self.function, self.left, self.best = function, limit, math.inf

    def __call__(self, x: Any) -> float:
        """Value at x."""
        value = self.function(x.tolist())
        self.left -= 1
        if self.left >= 0 and value < self.best:
            self.best = value
        return value


class NiapyProblem(Problem):
    """An objective as niapy wants it."""

    def __init__(self, objective: Callable[[Any], float], box: Box) -> None:
        super().__init__(len(box.lower), np.array(box.lower), np.array(box.upper))
        self.objective = objective

    def _evaluate(self, x: Array) -> float:
        return self.objective(x)


def niapy_ba(objective: Callable[[Any], float], box: Box, n: int, t: int, seed: int) -> None:
    """Let niapy's BatAlgorithm run with its defaults."""
    task = Task(problem=NiapyProblem(objective, box), max_evals=n * (t + 1))
    BatAlgorithm(population_size=n, seed=seed).run(task)


def mealpy_ba(kind: Any) -> Callable[..., None]:
    """One of mealpy's bat algorithms with its defaults."""

    def run(objective: Callable[[Any], float], box: Box, n: int, t: int, seed: int) -> None:
        problem = {
            "obj_func": objective,
            "bounds": FloatVar(lb=box.lower, ub=box.upper),
            "minmax": "min",
            "log_to": None,
        }
        kind(epoch=t, pop_size=n).solve(problem, seed=seed)

    return run


PEERS: dict[str, Callable[..., None]] = {
    "niapy BA": niapy_ba,
    "mealpy DevBA": mealpy_ba(BA.DevBA),
    "mealpy OriginalBA": mealpy_ba(BA.OriginalBA),
}


def peer_values(name: str, function: Function, runs: int) -> Array:
    """Best values of a peer's runs."""
    best = []
    for seed in range(runs):
        counted = Counted(function, EVALUATIONS)
        PEERS[name](counted, function.box(DIMENSION), POPULATION, ITERATIONS, seed)
        best.append(counted.best)
    return np.array(best)


def random_values(function: Function, runs: int) -> Array:
    """Best values of uniform random search."""
    best = np.empty(runs)
    low, high = (np.array(edge) for edge in function.box(DIMENSION).span())
    for seed in range(runs):
        points = low + Generator(PCG64(seed)).random((EVALUATIONS, DIMENSION)) * (high - low)
        best[seed] = function.batch(points).min()
    return best


def our_values(params: BatParams, function: Function, runs: int) -> Array:
    """Best values of our runs."""
    rngs = [Generator(PCG64(seed)) for seed in range(runs)]
    return minimize_batch(function.batch, function.box(DIMENSION), params, rngs).best_value


def interval(values: Array) -> tuple[float, float]:
    """95 % bootstrap interval of the mean (percentiles of 2000 resamples)."""
    rng = Generator(PCG64(0))
    means = [values[rng.integers(len(values), size=len(values))].mean() for _ in range(2000)]
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def ours() -> dict[str, BatParams]:
    """Our presets at the common budget, with BA's beta and with MFBA's."""
    budget: dict[str, Any] = {"population": POPULATION, "iterations": ITERATIONS}
    found = {
        f"robust {algorithm.name}": replace(SWARMS["robust"], algorithm=algorithm, **budget)
        for algorithm in Algorithm
    }
    return found | {"best": replace(SWARMS["best"], **budget)}


def quality(keys: Sequence[str], runs: int, peer_runs: int, peers: Sequence[str]) -> None:
    """Print mean, median, success and the wins of `best`."""
    wins: dict[str, list[str]] = {}
    for key, function in ((key, FUNCTIONS[key]) for key in keys):
        least = function.minimum(DIMENSION)
        print(f"\n{key} {function.title}: minimum {least:.7g}")
        print(f"{'':18}{'runs':>6}{'mean':>12}   {'95 % interval':25}{'median':>12}{'success':>9}")
        values = {name: our_values(params, function, runs) for name, params in ours().items()}
        values["random search"] = random_values(function, runs)
        for name in peers:
            values[name] = peer_values(name, function, peer_runs)
        for name, best in values.items():
            low, high = interval(best)
            print(
                f"{name:18}{len(best):6}{best.mean():12.4g}   [{low:11.4g}, {high:11.4g}]"
                f"{np.median(best):12.4g}{np.mean(best - least < SUCCESS):9.1%}",
                flush=True,
            )
        for name in ("random search", *peers):
            if values["best"].mean() < values[name].mean():
                wins.setdefault(name, []).append(key)
    print("\n`best` has the lower mean than")
    for name in ("random search", *peers):
        won = wins.get(name, [])
        print(f"  {name:18} on {len(won)} of {len(keys)}: {' '.join(won)}")


def single(params: BatParams, box: Box) -> Callable[[int], object]:
    """One run of ours for each seed."""
    return lambda seed: minimize(sphere, box, params, Generator(PCG64(seed)))


def batched(params: BatParams, box: Box, runs: int) -> Callable[[int], object]:
    """Many runs of ours for each seed."""

    def run(seed: int) -> object:
        rngs = [Generator(PCG64(seed * runs + k)) for k in range(runs)]
        return minimize_batch(FUNCTIONS["F1"].batch, box, params, rngs)

    return run


def peer(name: str, box: Box) -> Callable[[int], object]:
    """One run of a peer for each seed."""
    return lambda seed: PEERS[name](sphere, box, 5, ITERATIONS, seed)


def sphere(x: Any) -> float:
    """The cheapest objective, so that the algorithms' own cost shows."""
    return float(x[0] * x[0] + x[1] * x[1])


def speed(rounds: int) -> None:
    """Print microseconds per evaluation and ratios: one small run at a time, and many at once."""
    box, many = FUNCTIONS["F1"].box(DIMENSION), 200
    subjects: dict[str, tuple[Callable[[int], object], int]] = {}
    for name, run in PEERS.items():
        counted = Counted(sphere, 0)
        run(counted, box, 5, ITERATIONS, 0)
        subjects[f"{name}, 5 bats"] = peer(name, box), -counted.left
    for algorithm in Algorithm:
        params = replace(
            SWARMS["robust"], algorithm=algorithm, population=5, iterations=ITERATIONS
        )
        name = f"ours {algorithm.name}"
        subjects[f"{name}, 5 bats"] = single(params, box), 5 * (ITERATIONS + 1)
        swarm = replace(params, population=POPULATION)
        subjects[f"{name}, {many} runs of {POPULATION} bats"] = (
            batched(swarm, box, many),
            many * EVALUATIONS,
        )
    taken: dict[str, list[float]] = {name: [] for name in subjects}
    for seed in range(rounds + 1):
        for name, (run_once, evaluations) in subjects.items():
            start = time.process_time()
            run_once(seed)
            taken[name].append((time.process_time() - start) / evaluations * 1e6)
    medians = {name: statistics.median(times[1:]) for name, times in taken.items()}
    print(f"\nspeed: us per evaluation, median of {rounds} rounds (the first one warms up)")
    print(f"{'':34}{'us':>9}{'niapy /':>10}{'OriginalBA /':>14}{'DevBA /':>10}")
    for name, median in medians.items():
        ratios = [
            medians[f"{peer}, 5 bats"] / median
            for peer in ("niapy BA", "mealpy OriginalBA", "mealpy DevBA")
        ]
        print(f"{name:34}{median:9.3f}{ratios[0]:10.1f}{ratios[1]:14.1f}{ratios[2]:10.1f}")


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=2000, help="of ours and of random search")
    parser.add_argument("--peer-runs", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=15, help="of the measurement of speed")
    parser.add_argument("--all", action="store_true", help="quality of mealpy's OriginalBA too")
    parser.add_argument("--functions", nargs="+", choices=FUNCTIONS, default=list(FUNCTIONS))
    parser.add_argument("--only", choices=("speed", "quality"))
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # the peers' own
    versions = " ".join(
        f"{p} {importlib.metadata.version(p)}" for p in ("numpy", "niapy", "mealpy")
    )
    print(f"Python {platform.python_version()}, {versions}")
    print(
        f"d = {DIMENSION}, population {POPULATION}, {ITERATIONS} iterations, {EVALUATIONS} "
        f"evaluations; seeds 0..{options.runs - 1}, of the peers 0..{options.peer_runs - 1}"
    )
    if options.only != "quality":
        speed(options.rounds)
    if options.only == "speed":
        return
    peers = [name for name in PEERS if options.all or name != "mealpy OriginalBA"]
    quality(options.functions, options.runs, options.peer_runs, peers)


if __name__ == "__main__":
    main()
