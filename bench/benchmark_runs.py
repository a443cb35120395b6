# SPDX-License-Identifier: Apache-2.0
"""The runs of the benchmark: rows of tables, numbers of worlds, and the sweeps they share."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from mfba_planner.evaluation.study.chunk_store import Store
from mfba_planner.evaluation.study.compute_chunks import compute
from mfba_planner.evaluation.suites import suite as suite_of
from mfba_planner.evaluation.suites.named_suites import SPEED_MPS
from mfba_planner.evaluation.sweep.run_sweep import open_store, sweep
from mfba_planner.evaluation.sweep.summary import PlannerSummary, Versus, planner_summaries, versus
from mfba_planner.evaluation.sweep.sweep_chunks import OracleChunk, chunks_of
from mfba_planner.evaluation.sweep.sweep_spec import Setting, SweepSpec
from mfba_planner.evaluation.sweep.table_columns import Row, with_optimum
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.simulation.lidar_perception import LIDAR_ROBOTS

ORACLE = ("core", "evaluation", "scenarios", "simulation")  # their code decides the optima
# suites with --worlds
HEADLINE = ("random-10", "random-20", "random-30", "adversarial", "fast-10", "fast-20")
CROWDS = ("random-10", "random-20", "random-30", "fast-20")  # with several perceptions
STRIPPED = ("random-20", "random-30", "adversarial")  # in which ingredients are left out
PAPER_WORLDS = 2000  # 1000 seeds of each case are all that is asked for

LIDAR, REALISTIC, KNOWN = "lidar", "lidar-realistic", "known"
# What every planner is judged by, and how its rows are called.
COLUMNS = {LIDAR: "", REALISTIC: ", realistic", KNOWN: ", known"}

STEP_OF_PAPER = PlannerParams(speed_mps=SPEED_MPS)  # its own, 0.3 m
FINE = preset(STEP_OF_PAPER)  # 0.08 m, the same for all others


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a table; its setting has the speed of most suites, see at()."""

    label: str
    planner: str
    setting: Setting

    def at(self, suite: str) -> Setting:
        """The setting in a suite: at the speed of its robot."""
        speed = suite_of(suite).speed_mps
        return replace(self.setting, params=replace(self.setting.params, speed_mps=speed))


def _perceiving(perception: str, params: PlannerParams = FINE, **more: Any) -> Setting:
    return Setting(params=params, perception=perception, **more)


def _judged(planner: str, params: PlannerParams = FINE) -> tuple[Entry, ...]:
    return tuple(
        Entry(f"{planner}{suffix}", planner, _perceiving(perception, params))
        for perception, suffix in COLUMNS.items()
    )


def _without(name: str) -> str:
    return f"mfba_planner.planning.peers.ablation:{name}"


_WIDE = SensorParams(sensing_range_m=LIDAR_ROBOTS[LIDAR].robot.lidar.range_max_m)
_PAPER, _PREDICTIVE = _judged("paper", STEP_OF_PAPER), _judged("predictive")
_ORCA, _DWA = _judged("orca"), _judged("dwa")
PAPER, PREDICTIVE, ORCA, DWA = (each[0] for each in (_PAPER, _PREDICTIVE, _ORCA, _DWA))
PREDICTIVE_REALISTIC, PREDICTIVE_KNOWN = _PREDICTIVE[1:]
PAPER_KNOWN = _PAPER[2]
LEAD = (*_PAPER, *_PREDICTIVE, *_ORCA, *_DWA)
PEERS = (*_judged("vfh"), *_judged("apf"), Entry("straight", "straight", _perceiving(KNOWN)))
DIFFERENTIAL = Entry("lidar-differential", "predictive", _perceiving("lidar-differential"))
PERCEPTIONS = (
    replace(PREDICTIVE, label=LIDAR),
    DIFFERENTIAL,
    replace(PREDICTIVE_REALISTIC, label=REALISTIC),
    replace(PREDICTIVE_KNOWN, label="known within SR"),
    Entry("known as far as the lidar sees", "predictive", _perceiving(KNOWN, sensor=_WIDE)),
    Entry("scan-360, not beyond SR", "predictive", _perceiving("scan-360")),
    Entry("scan-12, not beyond SR", "predictive", _perceiving("scan-12")),
    Entry("the paper's sectors", "predictive", _perceiving("sectors")),
)
INGREDIENTS = (
    Entry("paper's bits, step 0.3 m", "paper", PAPER_KNOWN.setting),
    Entry("paper's bits, step 0.08 m", "paper", _perceiving(KNOWN)),
    *(
        Entry(label, _without(name), _perceiving(KNOWN))
        for label, name in (
            ("predicted bits only", "BitsOnly"),
            ("all without velocities", "NoVelocities"),
            ("all without bats", "NoBats"),
            ("all without waiting and slowing", "NoWaiting"),
            ("all without the last waypoint", "NoLastWaypoint"),
            ("all without memory of circles", "no_memory"),
            ("all without margins", "no_margins"),
        )
    ),
    Entry("all (predictive)", "predictive", PREDICTIVE_KNOWN.setting),
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
            suite=suite, planners=("straight",), worlds=worlds, first=self.first,
            setting=PREDICTIVE.at(suite),
        )  # fmt: skip
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
            oracle=False, setting=entry.at(suite),
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
            with_optimum(row, optima[number(row["world"])], spec.setting.params.speed_mps)
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
        else {
            **row,
            "gap": row["time_s"] * suite_of(row["suite"]).speed_mps / row["optimum_m"] - 1.0,
        }
        for row in rows
    ]


@cache
def _speed(suite: str) -> float:
    return suite_of(suite).speed_mps


def of_suite(entries: tuple[Entry, ...], suite: str) -> tuple[Entry, ...]:
    """Those lines, where they are reported for the suite."""
    where = {PERCEPTIONS: CROWDS, INGREDIENTS: STRIPPED}[entries]
    return entries if suite in where else ()


def print_line(line: str) -> None:
    """Print progress on stderr."""
    print(line, file=sys.stderr, flush=True)
