# SPDX-License-Identifier: Apache-2.0
"""Convergence on F1-F6: best value minus minimum after each iteration, over many runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..swarm.bat_swarm import Algorithm
from .benchmark_functions import FUNCTIONS
from .study.chunk import Benchmark
from .study.plan import SWARM_READINGS

RUNS = 100
READING = "robust"
QUANTILES = (0.1, 0.5, 0.9)


@dataclass(frozen=True, slots=True)
class Curve:
    """Best value minus minimum, shape (3, T + 1): one row for each of QUANTILES."""

    function: str
    algorithm: Algorithm
    error: np.ndarray


def curves(function: str, seeds: Sequence[int] = range(RUNS)) -> list[Curve]:
    """One curve per frequency law; the runs equal those of Table 3 with the same seeds."""
    found = []
    for algorithm in Algorithm:
        bat = replace(SWARM_READINGS[READING], algorithm=algorithm)
        history = Benchmark(function=function, bat=bat).search(seeds).history
        error = np.maximum(0.0, history - FUNCTIONS[function].minimum())
        found.append(Curve(function, algorithm, np.quantile(error, QUANTILES, axis=0)))
    return found
