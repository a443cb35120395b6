# SPDX-License-Identifier: Apache-2.0
"""Where the preset `best` comes from: a search over the swarm's options, F1-F6 held out.

    .venv/bin/python bench/find_best.py                # all of it, some ten minutes
    .venv/bin/python bench/find_best.py --random 30    # a small search

Settings of every option, first random ones, then children of the better ones, are tried on
twelve functions that are not in Table 2, their minima moved away from the middle; the better
ones go on to more runs. A setting's score is the mean over functions of log10 of its mean error
(floored at 1e-12): means, because one run that ends in a wrong valley is what a user remembers.
Ranges are scaled to the unit square, so that sigma is a share of the range. Every setting tried
is printed.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence

from mfba_planner.paper.readings_of_paper import SWARMS
from mfba_planner.swarm.bat_swarm import BatParams
from mfba_planner.swarm.batched_swarms import CACHED_BATS, minimize_batch
from mfba_planner.swarm.search_region import Box

Array = np.ndarray
Setting = dict[str, Any]
Scored = tuple[float, Setting]
POPULATION, ITERATIONS, FLOOR = 40, 200, 1e-12
BUDGET: dict[str, Any] = {"population": POPULATION, "iterations": ITERATIONS}
ROWS = CACHED_BATS // POPULATION  # runs that are iterated together
GENERATIONS = 4  # of children, after the random settings
FINAL = (12, 6)  # settings, and rounds of 17 runs per function


@dataclass(frozen=True)
class HeldOut:
    """A test function of two coordinates, its range, and how far its minimum 0 is moved."""

    name: str
    half: float
    shift: tuple[float, float]
    value: Callable[[Array, Array], Array]

    def batch(self, points: Array) -> Array:
        """Values (...) at points (..., 2)."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self.value(points[..., 0] - self.shift[0], points[..., 1] - self.shift[1])

    def box(self) -> Box:
        """Range of both coordinates."""
        return Box((-self.half,) * 2, (self.half,) * 2)

    def scaled(self, points: Array) -> Array:
        """Values at points of the unit square."""
        return self.batch((2.0 * points - 1.0) * self.half)


def ackley(x: Array, y: Array) -> Array:
    """Many shallow valleys in a funnel."""
    ripple = (np.cos(2 * np.pi * x) + np.cos(2 * np.pi * y)) / 2
    return -20 * np.exp(-0.2 * np.sqrt((x * x + y * y) / 2)) - np.exp(ripple) + 20 + math.e


def rosenbrock(x: Array, y: Array) -> Array:
    """A bent, narrow valley."""
    return 100 * (y - x * x) ** 2 + (1 - x) ** 2


def griewank(x: Array, y: Array) -> Array:
    """Valleys whose depths differ little."""
    return (x * x + y * y) / 4000 - np.cos(x) * np.cos(y / math.sqrt(2)) + 1


def schaffer_2(x: Array, y: Array) -> Array:
    """Rings around the minimum."""
    ring = np.sin(x * x - y * y) ** 2 - 0.5
    return 0.5 + ring / (1 + 0.001 * (x * x + y * y)) ** 2


def levy(x: Array, y: Array) -> Array:
    """Levy's function: ripples on a slope."""
    a, b = 1 + (x - 1) / 4, 1 + (y - 1) / 4
    middle = (a - 1) ** 2 * (1 + 10 * np.sin(np.pi * a + 1) ** 2)
    last = (b - 1) ** 2 * (1 + np.sin(2 * np.pi * b) ** 2)
    return np.sin(np.pi * a) ** 2 + middle + last


def zakharov(x: Array, y: Array) -> Array:
    """One valley, steep and flat."""
    s = 0.5 * x + y
    return x * x + y * y + s**2 + s**4


def beale(x: Array, y: Array) -> Array:
    """A flat floor and steep corners."""
    return (1.5 - x + x * y) ** 2 + (2.25 - x + x * y**2) ** 2 + (2.625 - x + x * y**3) ** 2


def himmelblau(x: Array, y: Array) -> Array:
    """Four minima of one depth."""
    return (x * x + y - 11) ** 2 + (x + y * y - 7) ** 2


def drop_wave(x: Array, y: Array) -> Array:
    """Rings that hide the middle."""
    square = x * x + y * y
    return 1 - (1 + np.cos(12 * np.sqrt(square))) / (0.5 * square + 2)


def styblinski_tang(x: Array, y: Array) -> Array:
    """Four valleys of different depths."""
    least = -78.33233140754282
    return (x**4 - 16 * x * x + 5 * x + y**4 - 16 * y * y + 5 * y) / 2 - least


def bohachevsky(x: Array, y: Array) -> Array:
    """A bowl with dents."""
    return x * x + 2 * y * y - 0.3 * np.cos(3 * np.pi * x) - 0.4 * np.cos(4 * np.pi * y) + 0.7


def foxhole(x: Array, y: Array) -> Array:
    """A hole in a plain that hardly leans."""
    square = x * x + y * y
    return 1 - np.exp(-square) + 1e-5 * np.sqrt(square)


FUNCTIONS = (
    HeldOut("ackley", 32.0, (7.3, -11.9), ackley),
    HeldOut("rosenbrock", 5.0, (-0.7, 0.4), rosenbrock),
    HeldOut("griewank", 100.0, (-31.0, 17.5), griewank),
    HeldOut("schaffer 2", 50.0, (9.1, 14.2), schaffer_2),
    HeldOut("levy", 10.0, (-3.3, 2.1), levy),
    HeldOut("zakharov", 10.0, (2.7, -4.4), zakharov),
    HeldOut("beale", 4.5, (0.6, -0.9), beale),
    HeldOut("himmelblau", 6.0, (0.3, 0.8), himmelblau),
    HeldOut("drop wave", 5.12, (-1.4, 2.2), drop_wave),
    HeldOut("styblinski-tang", 6.0, (0.9, -0.5), styblinski_tang),
    HeldOut("bohachevsky", 50.0, (-13.0, 21.0), bohachevsky),
    HeldOut("foxhole", 50.0, (18.0, -6.5), foxhole),
)


def setting(rng: Generator) -> Setting:
    """One random setting of the options; what is not named keeps the default."""

    def one_of(*choices: Any) -> Any:
        return choices[int(rng.integers(len(choices)))]

    def between(low: float, high: float, digits: int = 2) -> float:
        return round(float(rng.uniform(low, high)), digits)

    chosen: Setting = {
        "algorithm": one_of("ba", "mfba"),
        "rho": one_of(0.01, 0.5, 3.0),
        "f_max": round(10 ** float(rng.uniform(-1.3, 0.7)), 2),
        "inertia": one_of(0.0, between(0.0, 0.9), 1.0),
        "walk": one_of("best", "self"),
        "step": one_of("sigma", "pair", "pair"),
        "epsilon": one_of("per_coordinate", "scalar"),
        "acceptance": one_of("own", "own", "best"),
        "update": one_of("accepted", "always"),
        "alpha": one_of(1.0, 1.0, between(0.9, 0.999, 3)),
        "r0": between(0.0, 1.0),
        "gamma": one_of(0.02, 0.8),
    }
    short, long = (0.001, 1.0) if chosen["step"] == "sigma" else (0.2, 3.0)
    chosen["sigma"] = round(short * (long / short) ** float(rng.random()), 3)
    return chosen


def child(rng: Generator, parents: list[Setting]) -> Setting:
    """Each option from one of two parents or, one time in eight, anew; the walk in one piece."""
    mother, father = (parents[int(k)] for k in rng.choice(len(parents), 2, replace=False))
    new = setting(rng)
    born = {}
    for name in new:
        source = rng.random()
        born[name] = (new if source < 0.125 else mother if source < 0.5625 else father)[name]
    donor = next(one for one in (mother, father, new) if one["step"] == born["step"])
    born["sigma"] = donor["sigma"]
    if rng.random() < 0.5:
        for name in ("sigma", "f_max", "r0"):
            born[name] = round(
                min(1.0 if name == "r0" else 9.9, born[name] * 1.3 ** float(rng.normal())), 3
            )
    return born


def errors(params: BatParams, rounds: int, seed: int) -> list[float]:
    """Mean error on every held-out function; all settings together, 17 runs each per round."""
    count = ROWS // len(FUNCTIONS)

    def objective(points: Array) -> Array:
        groups = points.reshape(len(FUNCTIONS), count, *points.shape[1:])
        return np.concatenate([f.scaled(group) for f, group in zip(FUNCTIONS, groups)])

    values = []
    for child_of in SeedSequence(seed).spawn(rounds):
        rngs = [Generator(PCG64(one)) for one in child_of.spawn(count * len(FUNCTIONS))]
        result = minimize_batch(objective, Box((0.0, 0.0), (1.0, 1.0)), params, rngs)
        values.append(result.best_value.reshape(len(FUNCTIONS), count))
    means: list[float] = np.concatenate(values, axis=1).mean(axis=1).tolist()
    return means


def score(means: list[float]) -> float:
    """Mean of log10 of the mean errors; lower is better."""
    return sum(math.log10(max(FLOOR, mean)) for mean in means) / len(means)


def judged(settings: list[Setting], rounds: int, seed: int, title: str) -> list[Scored]:
    """Score the settings, best first, and print them."""
    start = time.perf_counter()
    scored = [
        (score(errors(BatParams(**BUDGET, **chosen), rounds, seed)), chosen) for chosen in settings
    ]
    scored.sort(key=lambda pair: pair[0])
    spent = time.perf_counter() - start
    print(f"\n{title}: {len(scored)} settings, {rounds} rounds each ({spent:.0f} s)")
    for value, chosen in scored:
        print(f"{value:8.3f}  " + " ".join(f"{k}={v}" for k, v in chosen.items()), flush=True)
    return scored


def compare(rivals: dict[str, BatParams], runs: int, seed: int) -> None:
    """Print mean errors on each held-out function, in its own range."""
    print(f"\nmean error over {runs} fresh runs, each function in its own range")
    print(f"{'':12}" + "".join(f"{function.name[:10]:>11}" for function in FUNCTIONS) + "  score")
    for name, params in rivals.items():
        means = []
        for k, function in enumerate(FUNCTIONS):
            children = SeedSequence(seed, spawn_key=(k,)).spawn(runs)
            rngs = [Generator(PCG64(one)) for one in children]
            result = minimize_batch(function.batch, function.box(), params, rngs)
            means.append(float(result.best_value.mean()))
        print(f"{name:12}" + "".join(f"{m:11.2e}" for m in means) + f"{score(means):7.2f}")


def main() -> None:
    """Print every setting tried, the finals, and the winner beside the other presets."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--random", type=int, default=160, help="random settings to start with")
    parser.add_argument("--seed", type=int, default=2024)
    options = parser.parse_args()
    rng = Generator(PCG64(options.seed))
    # Each round has seeds of its own, so that a setting cannot win by its luck in one.
    found = judged([setting(rng) for _ in range(options.random)], 1, options.seed, "random")
    for k in range(1, GENERATIONS + 1):
        parents = [chosen for _, chosen in found[:16]]
        born = [child(rng, parents) for _ in range(options.random // 2)]
        found += judged(born, 1, options.seed + k, f"children {k}")
        found.sort(key=lambda pair: pair[0])
    unique = {tuple(chosen.items()): chosen for _, chosen in found}  # the best first
    count, rounds = FINAL
    finalists = list(unique.values())[:count]
    found = judged(finalists, rounds, options.seed + GENERATIONS + 1, "final")
    rivals = {"the winner": BatParams(**BUDGET, **found[0][1])}
    rivals |= {name: replace(params, **BUDGET) for name, params in SWARMS.items()}
    compare(rivals, 200, options.seed + 100)


if __name__ == "__main__":
    main()
