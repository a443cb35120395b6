# SPDX-License-Identifier: Apache-2.0
"""Adapters of libraries conform and minimize; skipped where a library is not installed."""

import math
import os
import subprocess
import sys
from functools import cache
from importlib import import_module
from statistics import median

import numpy as np
import pytest
from numpy.random import PCG64, Generator

from mfba_planner.core.errors import ConfigError, OptimizerError
from mfba_planner.evaluation import optimizer_check
from mfba_planner.evaluation.optimizer_check import check
from mfba_planner.optimizers.registry import find_optimizer, optimize, require_optimizer
from mfba_planner.swarm.bat_swarm import BatParams, Box, Disc
from mfba_planner.swarm.optimizer import each, search

CONFORMING = [
    "scipy:differential_evolution",
    "cmaes:CMA",
    "niapy:ParticleSwarmAlgorithm",
    "niapy:BatAlgorithm",
    "niapy:GeneticAlgorithm",
    "niapy:GreyWolfOptimizer",
    "niapy:DifferentialEvolution",
    "mealpy:PSO.OriginalPSO",
    "mealpy:BA.OriginalBA",
    "mealpy:DE.OriginalDE",
    "mealpy:GWO.OriginalGWO",
    "mealpy:WOA.OriginalWOA",
]
# Refused, with the facts: by the check, or by the library for a swarm of five.
REFUSED = {
    "mealpy:PSS.OriginalPSS": ("same seed", "other points"),
    "mealpy:SHADE.L_SHADE": ("random numbers", "changes the state of numpy.random"),
    "mealpy:ArchOA.OriginalArchOA": ("region", "is outside the region"),
    "mealpy:AOA.OriginalAOA": ("ends", "'pop_size' is an integer and value should be in range"),
    "niapy:KrillHerd": ("failed values", "the point (nan, nan) is outside the region"),
}
BOX = Box((-3.0, 0.0, 10.0), (1.0, 0.5, 40.0))
MIDDLE = (-1.5, 0.2, 31.0)


def of_installed(name: str) -> str:
    pytest.importorskip(name.partition(":")[0])
    return name


def conforming(library: str) -> list[str]:
    return [name for name in CONFORMING if name.startswith(f"{library}:")]


@cache
def digests_elsewhere(library: str) -> list[list[str]]:
    """Two digests for each conforming name of a library, with PYTHONHASHSEED 0 and 1.

    As the check makes them, but in two processes for all names: importing mealpy takes seconds.
    """
    program = (
        "import sys; from mfba_planner.evaluation.optimizer_check import print_digest\n"
        "for name in sys.argv[1:]: print_digest(name)"
    )
    lines = [
        subprocess.run(
            [sys.executable, "-c", program, *conforming(library)],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        ).stdout.splitlines()
        for seed in "01"
    ]
    return [list(pair) for pair in zip(*lines, strict=True)]


@pytest.mark.parametrize("name", CONFORMING)
def test_an_adapter_has_every_property(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    library = of_installed(name).partition(":")[0]
    same = conforming(library)
    if len(same) > 1:
        pair = digests_elsewhere(library)[same.index(name)]
        monkeypatch.setattr(optimizer_check, "_digests_elsewhere", lambda *_: (pair, ""))
    found = list(check(name, 30.0))
    assert len(found) == 10
    assert all(one.ok for one in found), [str(one) for one in found if not one.ok]


@pytest.mark.parametrize("name", REFUSED)
def test_an_algorithm_that_does_not_conform_is_refused_with_the_reason(name: str) -> None:
    expected, text = REFUSED[name]
    found = next(one for one in check(of_installed(name), 30.0) if one.name == expected)
    assert not found.ok
    assert text in found.text


@pytest.mark.parametrize("name", CONFORMING)
def test_an_adapter_minimizes_in_a_box_of_unequal_sides(name: str) -> None:
    factory = find_optimizer(of_installed(name), BatParams())
    scale = [b - a for a, b in zip(*BOX.span())]

    def bowl(x: list[float]) -> float:
        return math.dist(*([v / s for v, s in zip(p, scale)] for p in (x, MIDDLE)))

    best = []
    for seed in range(5):
        made = factory(BOX, 600, Generator(PCG64(seed)), 10)
        best.append(search(made, BOX, 600, each(bowl)).best_value)
    # The best of ten random points is at 0.25; the bats of both libraries hardly get nearer.
    assert median(best) < (0.3 if "Bat" in name or "BA." in name else 0.15)


def test_cma_es_starts_again_where_its_criteria_end_it() -> None:
    pytest.importorskip("cmaes")
    made = find_optimizer("cmaes:CMA", BatParams())(Disc(0.3), 6000, Generator(PCG64(1)), 5)
    points: list[list[float]] = []

    def bowl(x: list[float]) -> float:
        points.append(x)
        return math.dist(x, (0.1, 0.1))

    search(made, Disc(0.3), 6000, each(bowl))
    spread = [np.ptp(points[k : k + 50], axis=0).max() for k in range(0, 6000, 50)]
    narrow = spread.index(min(spread))
    assert spread[narrow] < 1e-6
    assert max(spread[narrow:]) > 0.1


def test_niapy_keeps_no_error_to_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a child process its run() returns None instead."""
    pytest.importorskip("niapy")
    import multiprocessing

    monkeypatch.setattr(multiprocessing.current_process(), "_name", "Worker-1")
    with pytest.raises(OptimizerError, match=r"raised ValueError \(Cannot apply"):
        optimize(
            "niapy:ClonalSelectionAlgorithm", BatParams(), Disc(0.3), Generator(PCG64(1)),
            each(sum),
        )  # fmt: skip


@pytest.mark.parametrize("library", ["niapy", "mealpy"])
def test_names_of_a_library_are_its_algorithms(library: str) -> None:
    pytest.importorskip(library)
    names = import_module(f"mfba_planner.optimizers.{library}_search").names()
    assert len(names) > 60
    assert not {"mts_ls1", "multi_mutations", "optimizer.Optimizer"} & set(names)
    with pytest.raises(ConfigError, match=rf"unknown; did you mean '{library}:"):
        require_optimizer(f"{library}:{names[0]}x")
