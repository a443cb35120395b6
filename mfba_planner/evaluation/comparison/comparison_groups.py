# SPDX-License-Identifier: Apache-2.0
"""What a comparison has found: for each suite, planner and budget, ranks, pairs and figures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ..rank_tests import Ranks, rank, rank_biserial
from ..statistics import Array, Interval, Paired, generator, holm, mean, paired
from ..sweep.summary import PlannerSummary, by_world, planner_summaries
from ..sweep.table_columns import FAILED, Row

DIGITS = 6  # of a loss in a world: smaller differences are ties
LEAST_ERROR = 1e-12  # of a function: smaller ones are ties
LARGEST_ERROR = 1e300  # of a failed search; finite, so that differences are numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmResult:
    """Figures of one optimiser in a group; loss as in losses(), its mean over the cases.

    summary and turning_rad (of successes) are of worlds, errors (quartiles, inf for failed
    searches) of functions.
    """

    optimizer: str
    runs: int
    failed: int
    loss: Interval
    summary: PlannerSummary | None = None
    turning_rad: Interval | None = None
    errors: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """One optimiser against the reference on the same cases; lower losses win.

    p is Wilcoxon's, corrected by Holm over the pairs of the group; effect is the rank-biserial
    correlation, 1 where the optimiser is better than the reference in every case.
    """

    optimizer: str
    against: str
    paired: Paired
    p: float
    effect: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """All optimisers in one suite (or function), planner and budget.

    cases are worlds, or seeds of a function; left_out counts worlds without an optimum.
    """

    suite: str
    planner: str  # "" for a function
    budget: int
    arms: tuple[ArmResult, ...]
    ranks: Ranks | None
    pairs: tuple[Pair, ...]
    left_out: int = 0

    @property
    def cases(self) -> int:
        """The number of cases that are compared."""
        return 0 if self.ranks is None else self.ranks.n

    @property
    def is_function(self) -> bool:
        """Whether it is a function, not a suite of worlds."""
        return not self.planner

    @property
    def title(self) -> str:
        """Its name in reports."""
        suite, planner = f"suite {self.suite}", f"planner {self.planner}"
        where = self.suite if self.is_function else f"{suite}, {planner}"
        return f"{where}, {self.budget} evaluations"


def groups(
    rows: Sequence[Row], timings: Sequence[Row], against: str, *, oracle: bool
) -> list[Group]:
    """The groups of a table, as they come in it; oracle: whether it has the oracle's columns."""

    def key(row: Row) -> tuple[str, str, int]:
        return row["suite"], row["planner"], row["budget"]

    times = {where: list(some) for where, some in groupby(timings, key)}
    return [
        _group(where, list(some), times.get(where, []), against, number, oracle)
        for number, (where, some) in enumerate(groupby(rows, key))
    ]


def _group(
    where: tuple[str, str, int],
    rows: list[Row],
    timings: list[Row],
    against: str,
    number: int,
    oracle: bool,
) -> Group:
    names = list(dict.fromkeys(row["optimizer"] for row in rows))
    by_optimizer = {
        name: losses([row for row in rows if row["optimizer"] == name], oracle=oracle)
        for name in names
    }
    cases = list(by_optimizer[names[0]])
    matrix = np.array([[by_optimizer[name][case] for name in names] for case in cases])
    reference = against if against in names else names[0]
    worlds = {row["world"] for row in rows}
    suite, planner, budget = where
    return Group(
        suite=suite,
        planner=planner,
        budget=budget,
        arms=tuple(_arms(names, rows, timings, matrix, number)),
        ranks=rank(matrix) if cases else None,
        pairs=tuple(_pairs(names, matrix, reference, number)) if cases else (),
        left_out=len(worlds) - len(cases) if planner else 0,
    )


def losses(rows: Sequence[Row], *, oracle: bool) -> dict[int, float]:
    """The loss of one optimiser in each case, lower is better.

    In a world it is 1 - SPL, mean over the seeds: 1 for a failure, else 1 - optimum / length.
    Worlds without an optimum are left out. Without oracle the straight line stands for the
    optimum. Of a function it is the error of each seed.
    """
    if rows and not rows[0]["planner"]:
        return {row["seed"]: _error(row) for row in rows}
    name = "optimum_m" if oracle else "straight_m"
    known = [row for row in rows if not oracle or row[name] is not None]
    found = by_world(known, lambda row: _loss(row, name))
    return {world: round(loss, DIGITS) for world, loss in found.items()}


def _loss(row: Row, name: str) -> float:
    if not row["success"]:
        return 1.0
    reference = float(row[name])
    return 1.0 - reference / max(float(row["length_m"]), reference)


def _error(row: Row) -> float:
    error = row["error"]
    return min(error, LARGEST_ERROR) if error >= LEAST_ERROR else 0.0


def _inf(error: float) -> float:
    """The error, inf for a failed search."""
    return float(error) if error < LARGEST_ERROR else math.inf


def _arms(
    names: Sequence[str], rows: list[Row], timings: list[Row], matrix: Array, number: int
) -> Iterator[ArmResult]:
    for k, name in enumerate(names):
        own = [row for row in rows if row["optimizer"] == name]
        values = matrix[:, k] if len(matrix) else np.array([math.nan])
        quartiles, summary, turning = None, None, None
        if own[0]["planner"]:
            times = [row for row in timings if row["optimizer"] == name]
            (summary,) = planner_summaries(own, times)
            turns = by_world([r for r in own if r["success"]], lambda row: row["turning_rad"])
            if turns:
                turning = mean(np.array(list(turns.values())), generator(number, k, 1))
        else:
            low, middle, high = np.percentile(values, [25, 50, 75], method="inverted_cdf")
            quartiles = _inf(low), _inf(middle), _inf(high)
        yield ArmResult(
            optimizer=name,
            runs=len(own),
            failed=sum(row["outcome"] == FAILED for row in own),
            loss=mean(values, generator(number, k, 0)),
            summary=summary,
            turning_rad=turning,
            errors=quartiles,
        )


def _pairs(names: Sequence[str], matrix: Array, reference: str, number: int) -> Iterator[Pair]:
    theirs = matrix[:, names.index(reference)]
    others = [(k, name) for k, name in enumerate(names) if name != reference]
    met = [paired(matrix[:, k], theirs, generator(number, k, 2)) for k, _ in others]
    for (k, name), found, p in zip(others, met, holm([one.rank_p for one in met])):
        yield Pair(
            optimizer=name,
            against=reference,
            paired=found,
            p=p,
            effect=rank_biserial(matrix[:, k], theirs),
        )
