# SPDX-License-Identifier: Apache-2.0
"""The chunks of the paper's study: some seeds of one sample each, computed independently."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.option_specs import Scalar, flatten
from ...evaluation.metrics import assess
from ...planning.planner_params import PlannerParams
from ...simulation.run_episode import run
from ...simulation.scenario import Scenario
from ...swarm.bat_swarm import BatParams
from ...swarm.batched_swarms import BatchResult, minimize_batch
from ..benchmark_functions import FUNCTIONS

Columns = dict[str, list[float]]

BENCHMARK_STREAM = 2  # spawn key of these runs' SeedSequence children; the planner has others


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """Runs of a swarm on a function of Table 2; best value per seed."""

    function: str
    bat: BatParams
    dimension: int = 2

    @property
    def cost(self) -> float:
        """Approximate time of a run (ms)."""
        return 4e-4 * self.bat.population * self.bat.iterations

    def facts(self) -> dict[str, Scalar]:
        """Everything that the numbers depend on, as plain values."""
        return {"function": self.function, "dimension": self.dimension, **flatten(self.bat)}

    def run(self, seeds: Sequence[int]) -> Columns:
        """Best value of the run of each seed."""
        return {"best": self.search(seeds).best_value.tolist()}

    def search(self, seeds: Sequence[int]) -> BatchResult:
        """The runs; each random stream depends on seed, function and law."""
        function = FUNCTIONS[self.function]
        key = (BENCHMARK_STREAM, int(self.function[1:]), _number(self.bat.algorithm.value))
        rngs = [
            np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
            for seed in seeds
        ]
        return minimize_batch(function.batch, function.box(self.dimension), self.bat, rngs)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trips:
    """Episodes of Algorithm 1 in one scenario, as by `mfba sim --planner paper`."""

    scenario: Scenario
    planner: PlannerParams

    @property
    def cost(self) -> float:
        """Approximate time of a run (ms)."""
        return 25.0

    def facts(self) -> dict[str, Scalar]:
        """Everything that the numbers depend on, as plain values."""
        return {"scenario": repr(self.scenario), **flatten(self.planner)}

    def run(self, seeds: Sequence[int]) -> Columns:
        """For each seed: length, clearance, contacts, goal reached or not, turning, encounters.

        encounters is an integer with bit 2^i set for obstacle i.
        """
        rows = [self._row(seed) for seed in seeds]
        return {name: [row[name] for row in rows] for name in rows[0]}

    def _row(self, seed: int) -> dict[str, float]:
        result, run_motion = assess(run(self.scenario, planner=self.planner, seed=seed))
        return {
            "length_m": result.length_m,
            "clearance_m": result.min_clearance_m,
            "collisions": result.collisions,
            "reached": int(result.outcome.value == "goal_reached"),
            "turning_rad": run_motion.turning_rad,
            "encounters": sum(1 << number for number in result.encounters),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleChunk:
    """Seeds first .. first + count - 1 of the sample of that name."""

    sample: str
    work: Benchmark | Trips
    first: int
    count: int

    @property
    def name(self) -> str:
        """Name of the chunk, usable as a file name."""
        return f"{self.sample.replace('/', '-')}-{self.first}-{self.count}"

    @property
    def cost(self) -> float:
        """Approximate computing time (ms), for a progress bar."""
        return self.count * self.work.cost

    def facts(self) -> Mapping[str, Any]:
        """Everything that the numbers depend on, as plain values."""
        return {"sample": self.sample, **self.work.facts()}

    def run(self) -> Columns:
        """Compute the chunk."""
        return self.work.run(range(self.first, self.first + self.count))


def chunks(
    sample: str, work: Benchmark | Trips, first: int, runs: int, size: int
) -> list[SampleChunk]:
    """A sample split into chunks of this size."""
    last = first + runs
    return [
        SampleChunk(sample=sample, work=work, first=start, count=min(size, last - start))
        for start in range(first, last, size)
    ]


def _number(name: str) -> int:
    """A text as an integer, for a spawn key."""
    return int.from_bytes(name.encode(), "big")
