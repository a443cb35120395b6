# SPDX-License-Identifier: Apache-2.0
"""Specification of a comparison of optimisers: each of its arms is a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ...core.errors import ConfigError
from ...core.option_specs import did_you_mean
from ...optimizers.registry import NONE, require_optimizer
from ...planning.planner_params import PlannerParams
from ...swarm.bat_swarm import BatParams
from ..study.chunk import Columns
from ..sweep.run_sweep import spec_facts
from ..sweep.sweep_chunks import OracleChunk, RunsChunk
from ..sweep.sweep_chunks import chunks_of as chunks_of_sweep
from ..sweep.sweep_spec import SweepSpec
from ..sweep.table import build
from ..sweep.table_columns import COLUMNS, TIMINGS, Row

ARM: dict[str, tuple[type, str]] = {
    "optimizer": (str, "optimiser, as planner.optimizer names it"),
    "budget": (int, "evaluations per decision, or per search of a function"),
}
ERROR: dict[str, tuple[type, str]] = {
    "error": (float, "of a function: best value - minimum; inf for a failed search")
}


def _with_arm(columns: Mapping[str, tuple[type, str]]) -> dict[str, tuple[type, str]]:
    """The columns, with those of ARM after the planner."""
    return {
        name: kind
        for item in columns.items()
        for name, kind in ([item, *ARM.items()] if item[0] == "planner" else [item])
    }


TABLE = {**_with_arm(COLUMNS), **ERROR}
TIMING_TABLE = _with_arm(TIMINGS)


class Arm(NamedTuple):
    """One optimiser in one planner, suite and budget (evaluations per decision)."""

    suite: str
    planner: str
    budget: int
    optimizer: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonSpec:
    """Optimisers x sweeps x planners of each sweep x budgets.

    sweeps are those of the planners with their own optimiser; against is the optimiser that all
    others are compared with.
    """

    sweeps: tuple[SweepSpec, ...]
    optimizers: tuple[str, ...]
    budgets: tuple[int, ...]
    against: str

    def __post_init__(self) -> None:
        """Raise ConfigError for an invalid value, with the nearest name for an unknown one."""
        check_optimizers(self.optimizers, self.against)
        _once("--budget", self.budgets)
        _once("suite", [sweep.suite for sweep in self.sweeps])
        for arm in self.arms():
            self.sweep_of(arm)

    def arms(self) -> list[Arm]:
        """All arms, in the sequence of the table."""
        return [
            Arm(sweep.suite, planner, budget, optimizer)
            for sweep in self.sweeps
            for planner in sweep.planners
            for budget in self.budgets
            for optimizer in self.optimizers
        ]

    def sweep_of(self, arm: Arm) -> SweepSpec:
        """The sweep of one arm."""
        (sweep,) = (sweep for sweep in self.sweeps if sweep.suite == arm.suite)
        setting = sweep.setting_of(arm.planner)
        params = with_search(setting.params, arm.optimizer, self._searched(arm))
        return replace(
            sweep, planners=(arm.planner,), setting=replace(setting, params=params), own={}
        )

    def chunks_of(self, arm: Arm) -> list[RunsChunk | OracleChunk]:
        """The chunks of an arm; those of the oracle are the same for all arms of a suite."""
        number = self.optimizers.index(arm.optimizer)
        label = f"{arm.suite}-{arm.planner}-{self._searched(arm)}-{number}"
        return [
            chunk
            if isinstance(chunk, OracleChunk)
            else replace(chunk, name=f"{label}-{chunk.runs[0].world}-{len(chunk.runs)}")
            for chunk in chunks_of_sweep(self.sweep_of(arm))
        ]

    def chunks(self) -> list[RunsChunk | OracleChunk]:
        """All chunks, each once."""
        found = {chunk.name: chunk for arm in self.arms() for chunk in self.chunks_of(arm)}
        return list(found.values())

    def _searched(self, arm: Arm) -> int:
        """The budget; without a search all are the same, so the first stands for them."""
        return self.budgets[0] if arm.optimizer == NONE else arm.budget

    def facts(self) -> dict[str, Any]:
        """The specification as plain data, for the manifest."""
        return {
            "sweeps": [spec_facts(sweep) for sweep in self.sweeps],
            "optimizers": list(self.optimizers),
            "budgets": list(self.budgets),
            "against": self.against,
            "libraries": library_versions(self.optimizers),
        }


def check_optimizers(optimizers: tuple[str, ...], against: str) -> None:
    """Raise ConfigError for less than two optimisers, or one that is unknown or given twice."""
    for name in optimizers:
        require_optimizer(name)
    _once("--optimizer", optimizers)
    if len(optimizers) < 2:
        raise ConfigError(f"--optimizer {' '.join(optimizers)}: one alone; give at least two")
    if against not in optimizers:
        raise ConfigError(
            f"--against {against}: not compared; {did_you_mean(against, list(optimizers))}"
        )


def _once(option: str, values: Any) -> None:
    for k, value in enumerate(values):
        if value in values[:k]:
            raise ConfigError(f"{option} {value}: given twice; give each once")


def with_search(params: PlannerParams, optimizer: str, budget: int) -> PlannerParams:
    """The parameters of a planner with another optimiser and so many evaluations per decision.

    Raises ConfigError for a budget that the population does not divide.
    """
    return replace(params, optimizer=optimizer, bat=with_budget(params.bat, budget))


def with_budget(bat: BatParams, budget: int) -> BatParams:
    """The swarm with so many evaluations. Raises ConfigError as with_search()."""
    swarms, rest = divmod(budget, bat.population)
    if rest or swarms < 2:
        near = max(2, round(budget / bat.population)) * bat.population
        raise ConfigError(
            f"--budget={budget}: not two or more times the population of {bat.population}; "
            f"give {near}"
        )
    return replace(bat, iterations=swarms - 1)


def library_versions(optimizers: tuple[str, ...]) -> dict[str, str]:
    """Versions of the libraries that names with a colon begin with, where installed."""
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    for library in sorted({name.partition(":")[0] for name in optimizers if ":" in name}):
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            continue  # the user's own module
    return found


def rows_of(spec: ComparisonSpec, found: Mapping[str, Columns]) -> tuple[list[Row], list[Row]]:
    """Rows of the table and of the timings, arm by arm."""
    rows: list[Row] = []
    timings: list[Row] = []
    for arm in spec.arms():
        own = {"optimizer": arm.optimizer, "budget": arm.budget}
        of_arm, times = build(spec.sweep_of(arm), spec.chunks_of(arm), found)
        rows += [{**dict.fromkeys(TABLE), **row, **own} for row in of_arm]
        timings += [{**row, **own} for row in times]
    return rows, timings
