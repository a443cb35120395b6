# SPDX-License-Identifier: Apache-2.0
"""The chunks of a sweep: runs of one planner, or oracle solutions of worlds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

from ...core.errors import MfbaError
from ...simulation.scenario import Scenario
from ...simulation.triggers import with_triggers
from ..oracle import solve
from ..study.chunk import Columns
from ..suites.scenario_suite import ScenarioSet
from ..suites.survivability import area_of, survivability
from ..suites.task_geometry import ROOM
from .single_run import generates_paths_together, run_one, run_together
from .sweep_spec import Run, Setting, SweepSpec
from .table_columns import Row, lost_row, run_row, timing_row
from .worker import Lost, run_in_worker

RUNS_AT_ONCE = 100
WORLDS_AT_ONCE = 20
ORACLE_PATIENCE_S = 3600.0
DIGITS = 6  # of an optimum in metres: further digits differ between makes of processors


@dataclass(frozen=True, slots=True, kw_only=True)
class RunsChunk:
    """Some runs of one planner."""

    name: str  # usable as a file name
    runs: tuple[Run, ...]
    setting: Setting

    @property
    def cost(self) -> float:
        """Estimated time in milliseconds; planners differ."""
        return 12.0 * len(self.runs)

    def facts(self) -> Mapping[str, Any]:
        """All inputs that determine the result."""
        return {"runs": self.runs, **self.setting.facts()}

    def run(self) -> Columns:
        """Compute the runs: COLUMNS (without the oracle's) and TIMINGS."""
        batches: list[tuple[Run, ...]] = [(run,) for run in self.runs]
        if generates_paths_together(self.runs[0].planner, self.setting):
            # The first run on its own, to time its decisions.
            batches = [batch for batch in (self.runs[:1], self.runs[1:]) if batch]
        found = list(self._rows(batches))
        names = dict.fromkeys(name for row in found for name in row)
        return {name: [row.get(name) for row in found] for name in names}

    def _rows(self, batches: Sequence[tuple[Run, ...]]) -> Iterator[Row]:
        """The rows, one per run; runs of a batch that hung or died are run again one by one."""
        # Collect all results first: a hung child is only ended when its generator is exhausted.
        results = list(run_in_worker(make, batches, self.setting, self.setting.patience_s))
        for batch, result in zip(batches, results):
            if not isinstance(result, Lost):
                yield from result
            elif len(batch) == 1:
                yield lost_row(batch[0], result.why)
            else:
                yield from self._rows([(run,) for run in batch])


def make(runs: tuple[Run, ...], setting: Setting) -> list[Row]:
    """Compute runs in this process, several together; their rows with timings."""
    started = perf_counter()
    single = len(runs) == 1
    done = [run_one(runs[0], setting, whole=False)] if single else run_together(runs, setting)
    made = [(completed.times_ns, run_row(run, completed)) for run, completed in zip(runs, done)]
    wall_ms = 1e3 * (perf_counter() - started) / len(runs)
    return [{**timing_row(times_ns, wall_ms), **row} for times_ns, row in made]


@dataclass(frozen=True, slots=True, kw_only=True)
class OracleChunk:
    """Oracle solutions of some worlds, by world number."""

    suite: str
    suite_seed: int
    worlds: tuple[int, ...]
    speed_mps: float
    scenarios: ScenarioSet | None = None

    @property
    def name(self) -> str:
        """Name, usable as a file name."""
        return f"{self.suite}-oracle-{self.worlds[0]}-{len(self.worlds)}"

    @property
    def cost(self) -> float:
        """Estimated time in milliseconds; worlds differ."""
        return 150.0 * len(self.worlds)

    def facts(self) -> Mapping[str, Any]:
        """All inputs that determine the result."""
        facts = {"suite_seed": self.suite_seed, "speed_mps": self.speed_mps}
        return facts if self.scenarios is None else {**facts, "scenarios": self.scenarios.digest()}

    def world(self, number: int) -> Scenario:
        """The world with this number."""
        setting = Setting(suite_seed=self.suite_seed, scenarios=self.scenarios)
        return setting.suite(self.suite).world(number, self.speed_mps)

    def run(self) -> Columns:
        """Solve the worlds. Raises MfbaError for a world that takes too long."""
        found = []
        for world, result in zip(
            self.worlds, run_in_worker(solve_world, self.worlds, self, ORACLE_PATIENCE_S)
        ):
            if isinstance(result, Lost):
                raise MfbaError(
                    f"{self.suite}, world {world}: the oracle {result.why}; leave that world out, "
                    "or give --no-oracle"
                )
            found.append(result)
        return {name: [row[name] for row in found] for name in found[0]}


def solve_world(world: int, optima: OracleChunk) -> Row:
    """The oracle's columns of one world."""
    scenario = optima.world(world)
    solution = solve(scenario, optima.speed_mps)
    area = ROOM if optima.scenarios is None else area_of(scenario)
    share = None  # a robot that stands still may or may not have started what waits
    if not with_triggers(scenario):
        share = survivability(scenario, optima.speed_mps, area).share
    return {
        "world": world,
        "certificate": solution.certificate.value,
        "optimum_m": round(solution.length_m, DIGITS),
        "survivability": share,
    }


def chunks_of(spec: SweepSpec) -> list[RunsChunk | OracleChunk]:
    """All chunks of a sweep; independent of workers and executor."""
    at_once = max(1, RUNS_AT_ONCE // spec.seeds)
    chunks: list[RunsChunk | OracleChunk] = [*(_optima(spec) if spec.oracle else ())]
    for planner in spec.planners:
        for first in spec.world_range[::at_once]:
            worlds = range(first, min(first + at_once, spec.world_range.stop))
            chunks.append(
                RunsChunk(
                    name=f"{spec.suite}-{_plain(planner)}-{first}-{len(worlds)}",
                    runs=tuple(spec.runs(planner, worlds)),
                    setting=_with_worlds(spec.setting_of(planner), worlds),
                )
            )
    return chunks


def _with_worlds(setting: Setting, worlds: range) -> Setting:
    """The setting with the content of these worlds only."""
    if setting.scenarios is None:
        return setting
    return replace(setting, scenarios=setting.scenarios.only(worlds))


def _optima(spec: SweepSpec) -> Iterator[OracleChunk]:
    worlds, scenarios = spec.setting.suite(spec.suite), spec.setting.scenarios
    numbers = sorted({worlds.world_number(k) for k in spec.world_range})
    for first in range(0, len(numbers), WORLDS_AT_ONCE):
        some = tuple(numbers[first : first + WORLDS_AT_ONCE])
        yield OracleChunk(
            suite=spec.suite,
            suite_seed=spec.setting.suite_seed,
            worlds=some,
            speed_mps=spec.setting.params.speed_mps,
            scenarios=scenarios and scenarios.only(some),
        )


def gather(
    chunks: list[RunsChunk | OracleChunk], found: Mapping[str, Columns]
) -> tuple[list[Row], list[Row]]:
    """A row for each run, and a row for each world that the oracle solved."""
    runs: list[Row] = []
    optima: list[Row] = []
    for chunk in chunks:
        columns = found[chunk.name]
        rows_of = [dict(zip(columns, values)) for values in zip(*columns.values())]
        (optima if isinstance(chunk, OracleChunk) else runs).extend(rows_of)
    return runs, optima


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() or c in "._" else "-" for c in name)
