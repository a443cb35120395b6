# SPDX-License-Identifier: Apache-2.0
"""Optimisers on the functions of Table 2, with a budget: chunks and rows of `mfba compare`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from ..core.errors import ConfigError, OptimizerError
from ..core.option_specs import flatten, require_range
from ..evaluation.comparison.comparison_spec import TABLE, TIMING_TABLE, with_budget
from ..evaluation.study.chunk import Columns
from ..evaluation.sweep.sweep_spec import MOST_RUNS, Setting
from ..evaluation.sweep.table_columns import FAILED, Row
from ..evaluation.sweep.worker import Lost, run_in_worker
from ..optimizers.registry import NONE, find_optimizer, make
from ..swarm.bat_swarm import BatParams
from ..swarm.optimizer import each, search
from .benchmark_functions import FUNCTIONS
from .study.plan import DIMENSION

STREAM = 7  # spawn key of these runs' SeedSequence children
SEARCHED = "searched"  # the outcome of a search that ended


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionChunk:
    """Searches of one optimiser on one function, with seeds 0 .. seeds - 1.

    patience_s is the wall time after which a search counts as hung.
    """

    name: str  # usable as a file name
    function: str
    optimizer: str
    budget: int
    seeds: int
    bat: BatParams
    patience_s: float

    @property
    def cost(self) -> float:
        """Estimated time in milliseconds."""
        return 0.005 * self.budget * self.seeds

    def facts(self) -> Mapping[str, Any]:
        """All inputs that determine the result."""
        return {
            "function": self.function,
            "optimizer": self.optimizer,
            "budget": self.budget,
            "seeds": self.seeds,
            **flatten(self.bat),
        }

    def run(self) -> Columns:
        """Search with every seed: error, failure and wall time."""
        results = run_in_worker(search_once, range(self.seeds), self, self.patience_s)
        found = [(math.inf, r.why, 0.0) if isinstance(r, Lost) else r for r in results]
        errors, failures, times = zip(*found)
        return {"error": list(errors), "failure": list(failures), "wall_ms": list(times)}


def search_once(seed: int, chunk: FunctionChunk) -> tuple[float, str, float]:
    """Best value found minus the minimum, the failure ("" for none), and the wall time (ms)."""
    function = FUNCTIONS[chunk.function]
    # The same stream for every optimiser and budget.
    key = (STREAM, int(chunk.function[1:]))
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
    region, failure, error = function.box(DIMENSION), "", math.inf
    started = perf_counter()
    try:
        factory = find_optimizer(chunk.optimizer, chunk.bat)
        made = make(factory, region, chunk.budget, generator, chunk.bat.population)
        found = search(made, region, chunk.budget, each(function))
        error = max(0.0, found.best_value - function.minimum(DIMENSION))
    except OptimizerError as fault:
        failure = str(fault)
    return error, failure, 1e3 * (perf_counter() - started)


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionSpec:
    """Optimisers x functions x budgets x seeds; optimiser "none" is left out."""

    functions: tuple[str, ...]
    optimizers: tuple[str, ...]
    budgets: tuple[int, ...]
    seeds: int
    bat: BatParams
    patience_s: float

    def __post_init__(self) -> None:
        """Raise ConfigError for less than two optimisers that search, or values out of range."""
        require_range("--runs", self.seeds, 1, MOST_RUNS)
        Setting(patience_s=self.patience_s)  # the same limits as in worlds
        if self.functions and len(self._searching) < 2:
            raise ConfigError(
                f"{self.functions[0]}: only {' '.join(self._searching)} searches a function; "
                "give another --optimizer, or leave the functions out"
            )

    @property
    def _searching(self) -> list[str]:
        return [name for name in self.optimizers if name != NONE]

    def chunks(self) -> list[FunctionChunk]:
        """All chunks, in the sequence of the table."""
        return [
            FunctionChunk(
                name=f"{function}-{budget}-{self.optimizers.index(optimizer)}",
                function=function,
                optimizer=optimizer,
                budget=budget,
                seeds=self.seeds,
                bat=with_budget(self.bat, budget),
                patience_s=self.patience_s,
            )
            for function in self.functions
            for budget in self.budgets
            for optimizer in self._searching
        ]

    def facts(self) -> dict[str, Any]:
        """The specification as plain data, for the manifest."""
        return {"functions": list(self.functions), "runs": self.seeds}


def rows_of(
    chunks: Sequence[FunctionChunk], found: Mapping[str, Columns]
) -> tuple[list[Row], list[Row]]:
    """Rows of the table and of the timings, one per search."""
    rows, timings = [], []
    for chunk in chunks:
        columns = found[chunk.name]
        for seed, (error, failure, wall_ms) in enumerate(
            zip(columns["error"], columns["failure"], columns["wall_ms"])
        ):
            key = {
                "suite": chunk.function,
                "world": 0,
                "planner": "",
                "optimizer": chunk.optimizer,
                "budget": chunk.budget,
                "seed": seed,
            }
            outcome = {"outcome": FAILED if failure else SEARCHED, "failure": failure}
            rows.append({**dict.fromkeys(TABLE), **key, **outcome, "error": error})
            timings.append({**dict.fromkeys(TIMING_TABLE), **key, "wall_ms": wall_ms})
    return rows, timings
