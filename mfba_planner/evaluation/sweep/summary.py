# SPDX-License-Identifier: Apache-2.0
"""Summary of a sweep: figures of each planner, and paired comparisons on the same worlds."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..oracle import Certificate
from ..statistics import Interval, Paired, estimate, generator, mean, paired, rate
from .table_columns import FAILED, Row

REASONS = 3  # of failure that are named in reports
Value = Callable[[Row], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSummary:
    """One planner's figures; rates with Wilson's, means with bootstrap intervals (95 %).

    certified is the success rate on worlds that the oracle certifies as feasible. gap,
    gap_95 (95th percentile), length, time and clearance are over successes, means over worlds;
    spl and barn over all worlds that have an optimum. None without such runs.
    """

    planner: str
    runs: int
    success: Interval
    certified: Interval | None
    certified_runs: int
    collisions: int
    hits_moving: int
    hits_standing: int
    timeouts: int
    failures: tuple[tuple[str, int], ...]
    length_m: Interval | None
    time_s: Interval | None
    gap: Interval | None
    gap_95: Interval | None
    spl: Interval | None
    barn: Interval | None
    clearance_m: Interval | None
    decision_us: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Versus:
    """One planner against another in the same worlds with the same seeds.

    wins and losses count runs in which only one of them succeeded, p is the exact sign test's
    (McNemar). gap compares the gaps of worlds in which all runs of both succeeded.
    """

    planner: str
    other: str
    wins: int
    losses: int
    p: float
    gap: Paired | None


def planner_summaries(rows: Sequence[Row], timings: Sequence[Row]) -> list[PlannerSummary]:
    """A PlannerSummary for each planner, as they come in the table."""
    names = list(dict.fromkeys(row["planner"] for row in rows))
    return [
        _summary(name, k, [r for r in rows if r["planner"] == name], timings)
        for k, name in enumerate(names)
    ]


def _summary(name: str, number: int, rows: list[Row], timings: Sequence[Row]) -> PlannerSummary:
    successes = [row for row in rows if row["success"]]
    certified = [r for r in rows if r["certificate"] == Certificate.FEASIBLE.value]
    gaps = by_world([row for row in successes if row["gap"] is not None], lambda row: row["gap"])
    times = [
        t["decision_us"] for t in timings if t["planner"] == name and _is_number(t["decision_us"])
    ]

    def over(subset: list[Row], column: str, key: int) -> Interval | None:
        values = list(by_world(subset, lambda row: row[column]).values())
        return mean(np.array(values), generator(number, key)) if values else None

    rated = [row for row in rows if row["spl"] is not None]
    return PlannerSummary(
        planner=name,
        runs=len(rows),
        success=rate(len(successes), len(rows)),
        certified=rate(sum(row["success"] for row in certified), len(certified))
        if certified
        else None,
        certified_runs=len(certified),
        collisions=sum(bool(row["collisions"]) for row in rows),
        hits_moving=sum(row["hits_moving"] or 0 for row in rows),
        hits_standing=sum(row["hits_standing"] or 0 for row in rows),
        timeouts=sum(row["outcome"] == "time_limit" for row in rows),
        failures=tuple(_reasons(rows).most_common()),
        length_m=over(successes, "length_m", 0),
        time_s=over(successes, "time_s", 5),
        gap=over([row for row in successes if row["gap"] is not None], "gap", 1),
        gap_95=estimate(np.array(list(gaps.values())), _percentile_95, generator(number, 6))
        if gaps
        else None,
        spl=over(rated, "spl", 2),
        barn=over(rated, "barn", 3),
        clearance_m=over(
            [r for r in successes if _is_number(r["min_clearance_m"])], "min_clearance_m", 4
        ),
        decision_us=float(np.median(times)) if times else None,
    )


def _percentile_95(values: np.ndarray) -> np.ndarray:
    found: np.ndarray = np.percentile(values, 95.0, axis=1)
    return found


def _reasons(rows: Sequence[Row]) -> Counter[str]:
    """Failures by reason, without the tick."""
    return Counter(
        row["failure"].partition(": ")[2] or row["failure"]
        for row in rows
        if row["outcome"] == FAILED
    )


def by_world(rows: Sequence[Row], value: Value) -> dict[int, float]:
    """Mean over the seeds of each world: runs in one world are not independent."""
    values: dict[int, list[float]] = {}
    for row in rows:
        values.setdefault(row["world"], []).append(value(row))
    return {world: math.fsum(found) / len(found) for world, found in values.items()}


def comparisons(rows: Sequence[Row]) -> list[Versus]:
    """Each planner against each one listed before it."""
    names = list(dict.fromkeys(row["planner"] for row in rows))
    return [versus(rows, name, other) for k, name in enumerate(names) for other in names[:k]]


def versus(rows: Sequence[Row], name: str, other: str) -> Versus:
    """One planner against another."""
    ours, theirs = (
        {(row["world"], row["seed"]): row for row in rows if row["planner"] == planner}
        for planner in (name, other)
    )
    cases = [key for key in ours if key in theirs]
    scores = np.array(
        [float(theirs[key]["success"]) - float(ours[key]["success"]) for key in cases]
    )
    met = paired(scores, np.zeros(len(cases)), generator(9))
    lost = {key[0] for key in cases if not (_has_gap(ours[key]) and _has_gap(theirs[key]))}
    a, b = (
        by_world([side[key] for key in cases if key[0] not in lost], lambda row: row["gap"])
        for side in (ours, theirs)
    )
    return Versus(
        planner=name,
        other=other,
        wins=met.wins,
        losses=met.losses,
        p=met.sign_p,
        gap=paired(np.array(list(a.values())), np.array(list(b.values())), generator(10))
        if a
        else None,
    )


def _has_gap(row: Row) -> bool:
    return bool(row["success"]) and row["gap"] is not None


def _is_number(value: float | None) -> bool:
    return value is not None and math.isfinite(value)
