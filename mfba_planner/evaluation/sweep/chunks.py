# SPDX-License-Identifier: Apache-2.0
"""The parts of a sweep: some runs of one planner, or the oracle's word on some worlds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from ...core.errors import MfbaError
from ..oracle import solve
from ..study.chunk import Columns
from ..suites import suite
from ..suites.survivability import survivability
from .columns import Row, lost_row, made_row, timing_row
from .single_run import generates_paths_together, run_one, run_together
from .sweep_spec import Run, Setting, SweepSpec
from .worker import Lost, each

RUNS_AT_ONCE = 100
WORLDS_AT_ONCE = 20
ORACLE_PATIENCE_S = 3600.0
DIGITS = 6  # of an optimum in metres: what is left below differs between makes of processors


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Some runs of one planner."""

    name: str  # fit for a file
    runs: tuple[Run, ...]
    setting: Setting

    @property
    def cost(self) -> float:
        """About, in milliseconds; planners differ."""
        return 12.0 * len(self.runs)

    def facts(self) -> Mapping[str, Any]:
        """What decides the numbers."""
        return {"runs": self.runs, **self.setting.facts()}

    def run(self) -> Columns:
        """Make the runs; COLUMNS (without the oracle's) and TIMINGS."""
        batches: list[tuple[Run, ...]] = [(run,) for run in self.runs]
        if generates_paths_together(self.runs[0].planner, self.setting):
            # One alone: what does a decision take?
            batches = [batch for batch in (self.runs[:1], self.runs[1:]) if batch]
        found = list(self._made(batches))
        names = dict.fromkeys(name for row in found for name in row)
        return {name: [row.get(name) for row in found] for name in names}

    def _made(self, batches: Sequence[tuple[Run, ...]]) -> Iterator[Row]:
        """The rows, in order; runs that are lost together are made again one by one."""
        # All answers first: a child that hangs is there until its last one has been asked for.
        answers = list(each(make, batches, self.setting, self.setting.patience_s))
        for batch, answer in zip(batches, answers):
            if not isinstance(answer, Lost):
                yield from answer
            elif len(batch) == 1:
                yield lost_row(batch[0], answer.why)
            else:
                yield from self._made([(run,) for run in batch])


def make(runs: tuple[Run, ...], setting: Setting) -> list[Row]:
    """Make some runs here, together where they are several; their rows and timings."""
    begun = perf_counter()
    alone = len(runs) == 1
    all_played = [run_one(runs[0], setting, whole=False)] if alone else run_together(runs, setting)
    made = [(played.times_ns, made_row(run, played)) for run, played in zip(runs, all_played)]
    wall_ms = 1e3 * (perf_counter() - begun) / len(runs)
    return [{**timing_row(times_ns, wall_ms), **row} for times_ns, row in made]


@dataclass(frozen=True, slots=True, kw_only=True)
class Optima:
    """The oracle's word on some worlds, by their number."""

    suite: str
    suite_seed: int
    worlds: tuple[int, ...]
    speed_mps: float

    @property
    def name(self) -> str:
        """Fit for a file."""
        return f"{self.suite}-oracle-{self.worlds[0]}-{len(self.worlds)}"

    @property
    def cost(self) -> float:
        """About, in milliseconds; worlds differ."""
        return 150.0 * len(self.worlds)

    def facts(self) -> Mapping[str, Any]:
        """What decides the numbers."""
        return {"suite_seed": self.suite_seed, "speed_mps": self.speed_mps}

    def run(self) -> Columns:
        """Ask the oracle. Raises MfbaError for a world over which it takes too long."""
        found = []
        for world, answer in zip(self.worlds, each(judge, self.worlds, self, ORACLE_PATIENCE_S)):
            if isinstance(answer, Lost):
                raise MfbaError(
                    f"{self.suite}, world {world}: the oracle {answer.why}; leave that world out, "
                    "or give --no-oracle"
                )
            found.append(answer)
        return {name: [row[name] for row in found] for name in found[0]}


def judge(world: int, of: Optima) -> Row:
    """The oracle's word on one world."""
    scenario = suite(of.suite, of.suite_seed).world(world, of.speed_mps)
    solution = solve(scenario, of.speed_mps)
    return {
        "world": world,
        "certificate": solution.certificate.value,
        "optimum_m": round(solution.length_m, DIGITS),
        "survivability": survivability(scenario, of.speed_mps).share,
    }


def chunks_of(order: SweepSpec) -> list[Runs | Optima]:
    """All parts of a sweep; what they are does not depend on who computes them."""
    at_once = max(1, RUNS_AT_ONCE // order.seeds)
    chunks: list[Runs | Optima] = [*(_optima(order) if order.oracle else ())]
    for planner in order.planners:
        for first in order.world_range[::at_once]:
            worlds = range(first, min(first + at_once, order.world_range.stop))
            chunks.append(
                Runs(
                    name=f"{order.suite}-{_plain(planner)}-{first}-{len(worlds)}",
                    runs=tuple(order.runs(planner, worlds)),
                    setting=order.setting_of(planner),
                )
            )
    return chunks


def _optima(order: SweepSpec) -> Iterator[Optima]:
    worlds = suite(order.suite, order.setting.suite_seed)
    numbers = sorted({worlds.world_number(k) for k in order.world_range})
    for begin in range(0, len(numbers), WORLDS_AT_ONCE):
        yield Optima(
            suite=order.suite,
            suite_seed=order.setting.suite_seed,
            worlds=tuple(numbers[begin : begin + WORLDS_AT_ONCE]),
            speed_mps=order.setting.params.speed_mps,
        )


def gather(
    chunks: list[Runs | Optima], found: Mapping[str, Columns]
) -> tuple[list[Row], list[Row]]:
    """A row for each run, and one for each world that the oracle was asked about."""
    runs: list[Row] = []
    optima: list[Row] = []
    for chunk in chunks:
        columns = found[chunk.name]
        rows_of = [dict(zip(columns, values)) for values in zip(*columns.values())]
        (optima if isinstance(chunk, Optima) else runs).extend(rows_of)
    return runs, optima


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() or c in "._" else "-" for c in name)
