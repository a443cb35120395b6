# SPDX-License-Identifier: Apache-2.0
"""The runs of the benchmark: rows of tables, numbers of worlds, and the sweeps they share."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from mfba_planner.evaluation.study.chunk_store import Store
from mfba_planner.evaluation.study.compute_chunks import compute
from mfba_planner.evaluation.suites import suite as suite_of
from mfba_planner.evaluation.suites.named_suites import SPEED_MPS
from mfba_planner.evaluation.sweep.run_sweep import open_store, sweep
from mfba_planner.evaluation.sweep.summary import PlannerSummary, Versus, planner_summaries, versus
from mfba_planner.evaluation.sweep.sweep_chunks import OracleChunk, chunks_of
from mfba_planner.evaluation.sweep.sweep_spec import Setting, SweepSpec
from mfba_planner.evaluation.sweep.table_columns import Row, with_optimum
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.predictive_planner import preset

ORACLE = ("core", "evaluation", "scenarios", "simulation")  # their code decides the optima
HEADLINE = ("random-10", "random-20", "random-30", "adversarial")  # suites with --worlds
CROWDS = ("random-10", "random-20", "random-30")  # with several perceptions
STRIPPED = ("random-20", "random-30", "adversarial")  # in which ingredients are left out
PAPER_WORLDS = 2000  # 1000 seeds of each case are all that is asked for

PAPER = Setting()  # its own step of 0.3 m
FINE = Setting(
    params=preset(PlannerParams(speed_mps=SPEED_MPS))
)  # 0.08 m, the same for all others


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a table."""

    label: str
    planner: str
    setting: Setting = FINE


def _perceiving(perception: str, noise_m: float = 0.0, latency_ticks: int = 0) -> Setting:
    return Setting(
        params=FINE.params, perception=perception, noise_m=noise_m, latency_ticks=latency_ticks
    )


def _without(name: str) -> str:
    return f"mfba_planner.planning.peers.ablation:{name}"


LEAD = (Entry("paper", "paper", PAPER), Entry("predictive", "predictive"), Entry("orca", "orca"))
PEERS = tuple(Entry(name, name) for name in ("dwa", "vfh", "apf", "straight"))
PERCEPTIONS = (
    Entry("known", "predictive"),
    Entry("scan-12", "predictive", _perceiving("scan-12")),
    Entry("scan-360", "predictive", _perceiving("scan-360")),
    Entry("scan-360, 2 cm noise", "predictive", _perceiving("scan-360", 0.02)),
    Entry("scan-360, 1 tick late", "predictive", _perceiving("scan-360", 0.0, 1)),
    Entry("scan-360, both", "predictive", _perceiving("scan-360", 0.02, 1)),
    Entry("the paper's sectors", "predictive", _perceiving("sectors")),
)
INGREDIENTS = (
    Entry("paper's bits, step 0.3 m", "paper", PAPER),
    Entry("paper's bits, step 0.08 m", "paper", Setting(params=FINE.params)),
    Entry("predicted bits only", _without("BitsOnly")),
    Entry("all without velocities", _without("NoVelocities")),
    Entry("all without bats", _without("NoBats")),
    Entry("all without waiting and slowing", _without("NoWaiting")),
    Entry("all without the last waypoint", _without("NoLastWaypoint")),
    Entry("all without memory of circles", _without("no_memory")),
    Entry("all without margins", _without("no_margins")),
    Entry("all (predictive)", "predictive"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Counts:
    """How many worlds of each kind."""

    worlds: int
    others: int
    few: int
    perception_worlds: int

    def lead(self, suite: str) -> int:
        """Worlds of the planners that lead."""
        if suite == "paper":
            return min(2 * self.worlds, PAPER_WORLDS)  # the two cases in turn
        return self.worlds if suite in HEADLINE else self.others

    def rest(self, suite: str) -> int:
        """Worlds of everything else."""
        return min(self.few, self.lead(suite))

    def perceived(self, suite: str) -> int:
        """Worlds of what predictive sees by something else than known circles."""
        return min(self.perception_worlds, self.lead(suite))


class Results:
    """Sweeps that are made (or read back) on demand, judged by optima that they share."""

    def __init__(self, out: Path, workers: int, executor: Executor | None, first: int = 0) -> None:
        """Every suite begins with its world number `first`."""
        self.out, self.workers, self.executor, self.first = out, workers, executor, first
        self.directories: dict[tuple[str, str, Setting], Path] = {}
        self._found: dict[tuple[str, str, Setting], tuple[list[Row], list[Row]]] = {}
        self._optima: dict[str, dict[int, Row]] = {}
        self._standings: dict[tuple[str, Entry, int, int, bool], PlannerSummary] = {}

    def judge(self, suite: str, worlds: int) -> None:
        """Ask the oracle about a suite."""
        spec = SweepSpec(
            suite=suite, planners=("straight",), worlds=worlds, first=self.first, setting=FINE
        )
        chunks = [chunk for chunk in chunks_of(spec) if isinstance(chunk, OracleChunk)]
        facts = {"suite": suite, "first": self.first, "worlds": worlds}
        store = Store(
            self.out / f"{suite}-optima", chunks, facts, command="benchmark", packages=ORACLE
        )
        found = compute(
            chunks, workers=self.workers, executor=self.executor, store=store, warn=print_line
        )
        columns = [found[chunk.name] for chunk in chunks]
        rows = [dict(zip(some, values)) for some in columns for values in zip(*some.values())]
        self._optima[suite] = {row["world"]: row for row in rows}

    def make(self, suite: str, entry: Entry, worlds: int) -> None:
        """Make the runs of one line."""
        key = (suite, entry.planner, entry.setting)
        spec = SweepSpec(
            suite=suite, planners=(entry.planner,), worlds=worlds, first=self.first,
            oracle=False, setting=entry.setting,
        )  # fmt: skip
        plain = "".join(c if c.isalnum() or c in ".-" else "-" for c in entry.label)
        self.directories[key] = self.out / f"{suite}-{plain}"
        store = open_store(self.directories[key], spec)
        swept = sweep(
            spec, workers=self.workers, executor=self.executor, store=store, warn=print_line
        )
        print_line(f"{suite}: {entry.label}, {worlds} worlds")
        optima, number = self._optima[suite], suite_of(suite).world_number
        rows = [
            with_optimum(row, optima[number(row["world"])], entry.setting.params.speed_mps)
            for row in swept.rows
        ]
        self._found[key] = rows, swept.timings

    def standing(
        self, suite: str, entry: Entry, worlds: int, case: int = 0, *, timed: bool = False
    ) -> PlannerSummary:
        """Figures of one line over the first so many worlds (of the paper's: of one case)."""
        key = (suite, entry, worlds, case, timed)
        if key not in self._standings:  # bootstrapping thousands of worlds takes seconds
            rows, timings = (self.of(kind, suite, entry, worlds, case) for kind in (0, 1))
            (self._standings[key],) = planner_summaries(_timed(rows) if timed else rows, timings)
        return self._standings[key]

    def versus(
        self, suite: str, entry: Entry, other: Entry, worlds: int, *, timed: bool = False
    ) -> Versus:
        """One line against another in the same worlds."""
        rows = [row for e in (entry, other) for row in self.of(0, suite, e, worlds)]
        return versus(_timed(rows) if timed else rows, entry.label, other.label)

    def of(self, kind: int, suite: str, entry: Entry, worlds: int, case: int = 0) -> list[Row]:
        """Rows (kind 0) or timings (1) under the label of their line."""
        return [
            {**row, "planner": entry.label}
            for row in self._found[suite, entry.planner, entry.setting][kind]
            if row["world"] < self.first + worlds and case in (0, row["world"] % 2 + 1)
        ]

    def make_all(self, suites: Sequence[str], counts: Counts) -> None:
        """Make everything; as many sweeps at once as keep all workers busy to the end."""
        with ThreadPoolExecutor(1 if self.executor is None else 2 * self.workers) as threads:
            list(threads.map(lambda suite: self.judge(suite, counts.lead(suite)), suites))
            list(threads.map(lambda sweep: self.make(*sweep), _sweeps(suites, counts)))


def _sweeps(suites: Sequence[str], counts: Counts) -> list[tuple[str, Entry, int]]:
    """Every sweep once, in the most worlds that any table has of it."""
    found = [(suite, entry, counts.lead(suite)) for suite in suites for entry in LEAD]
    known = {(suite, entry.planner, entry.setting) for suite, entry, _ in found}
    for suite in suites:
        rest, perceived = counts.rest(suite), counts.perceived(suite)
        wanted = [(entry, rest) for entry in (*PEERS, *of_suite(INGREDIENTS, suite))]
        wanted += [(entry, perceived) for entry in of_suite(PERCEPTIONS, suite)]
        for entry, worlds in wanted:
            if (suite, entry.planner, entry.setting) not in known:
                found.append((suite, entry, worlds))
    return found


def _timed(rows: Sequence[Row]) -> list[Row]:
    """The rows with gaps of time instead of length: waiting counts, too."""
    return [
        row
        if row["gap"] is None
        else {**row, "gap": row["time_s"] * SPEED_MPS / row["optimum_m"] - 1.0}
        for row in rows
    ]


def of_suite(entries: tuple[Entry, ...], suite: str) -> tuple[Entry, ...]:
    """Those lines, where they are reported for the suite."""
    where = {PERCEPTIONS: CROWDS, INGREDIENTS: STRIPPED}[entries]
    return entries if suite in where else ()


def print_line(line: str) -> None:
    """Print progress on stderr."""
    print(line, file=sys.stderr, flush=True)
