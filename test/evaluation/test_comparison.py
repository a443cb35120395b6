# SPDX-License-Identifier: Apache-2.0
"""Losses, groups and verdicts of a comparison of optimisers, from rows made by hand."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import wilcoxon

from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.comparison.comparison_groups import Group, groups, losses
from mfba_planner.evaluation.comparison.comparison_spec import (
    TABLE,
    ComparisonSpec,
    with_budget,
)
from mfba_planner.evaluation.comparison.verdict import Finding, finding, overall, tally, verdict
from mfba_planner.evaluation.sweep.sweep_chunks import OracleChunk
from mfba_planner.evaluation.sweep.sweep_spec import SweepSpec
from mfba_planner.evaluation.sweep.table_columns import Row
from mfba_planner.swarm.bat_swarm import BatParams


def row(optimizer: str, world: int, length_m: float, **more: Any) -> Row:
    """A run that reached its goal, 10 m along the optimum, if length_m is not inf."""
    reached = math.isfinite(length_m)
    own = {
        "suite": "random-10", "world": world, "planner": "paper", "optimizer": optimizer,
        "budget": 25, "seed": 0, "success": reached, "length_m": length_m if reached else 3.0,
        "outcome": "goal_reached" if reached else "time_limit", "optimum_m": 10.0,
        "straight_m": 9.0, "certificate": "feasible", "failure": "",
        "gap": length_m / 10.0 - 1.0 if reached else None,
        "spl": 10.0 / length_m if reached else 0.0, "barn": 0.1, "turning_rad": length_m,
        "collisions": 0, "time_s": 20.0, "min_clearance_m": 1.0,
    }  # fmt: skip
    return {**dict.fromkeys(TABLE), **own, **more}


def group_of(**lengths: list[float]) -> Group:
    """The group of optimisers with these lengths, world by world; the first is the reference."""
    rows = [row(name, k, v) for name, values in lengths.items() for k, v in enumerate(values)]
    (found,) = groups(rows, [], next(iter(lengths)), oracle=True)
    return found


def test_a_loss_is_1_minus_spl_and_1_for_a_failure() -> None:
    rows = [row("a", 0, 12.5), row("a", 1, math.inf), row("a", 2, 9.99)]
    assert losses(rows, oracle=True) == {0: 0.2, 1: 1.0, 2: 0.0}
    assert losses(rows, oracle=False) == {0: 0.28, 1: 1.0, 2: round(1 - 9 / 9.99, 6)}


def test_seeds_of_a_world_are_averaged_and_worlds_without_optimum_left_out() -> None:
    rows = [row("a", 0, 12.5), row("a", 0, math.inf, seed=1), row("a", 1, 11.0, optimum_m=None)]
    assert losses(rows, oracle=True) == {0: 0.6}
    other = [{**r, "optimizer": "b"} for r in rows]
    (found,) = groups([*rows, *other], [], "a", oracle=True)
    assert (found.cases, found.left_out, found.arms[0].runs) == (1, 1, 3)


def test_equal_lengths_but_for_rounding_are_ties() -> None:
    found = group_of(a=[11.0, 12.0], b=[11.0 + 1e-7, 12.0])
    assert found.ranks is not None
    assert found.ranks.mean == (1.5, 1.5)


def test_a_pair_is_that_of_scipy_and_corrected_by_holm() -> None:
    rng = np.random.default_rng(3)
    a, b, c = (10.0 + rng.random((3, 12)) * [[1.0], [2.0], [1.1]]).tolist()
    found = group_of(a=a, b=b, c=c)
    raw = []
    for values in (b, c):
        difference = [round(1 - 10 / x, 6) - round(1 - 10 / y, 6) for x, y in zip(values, a)]
        raw.append(float(wilcoxon(difference, method="asymptotic").pvalue))
    low, high = sorted(raw)
    expected = {low: min(1.0, 2 * low), high: max(high, min(1.0, 2 * low))}
    assert [pair.p for pair in found.pairs] == pytest.approx([expected[p] for p in raw])
    assert found.pairs[0].paired.losses == sum(x > y for x, y in zip(b, a))


NO_VERDICT = "No suite has enough worlds, and runs that succeed, for a verdict."
LENGTHS = [10.1 + 0.3 * k for k in range(12)]


@pytest.mark.parametrize(
    ("other", "expected", "shown"),
    [
        ([x + 1.0 for x in LENGTHS], Finding.WORSE, "worse: b."),
        ([x - 0.5 for x in LENGTHS], Finding.BETTER, "better: b."),
        ([x - 0.01 for x in LENGTHS], Finding.BETTER, "better: b (by less than 1 point)."),
        ([x + 0.01 * (-1) ** k for k, x in enumerate(LENGTHS)], Finding.EQUAL, "equal: b."),
        (LENGTHS, Finding.EQUAL, "equal: b."),
        ([x + 1.5 * (-1) ** k for k, x in enumerate(LENGTHS)], Finding.OPEN, "open: b."),
    ],
)
def test_the_rule_of_findings(other: list[float], expected: Finding, shown: str) -> None:
    found = group_of(a=LENGTHS, b=other)
    assert finding(found, found.pairs[0]) is expected
    assert verdict(found) == f"Two optimisers in 12 cases. Against a {shown}"
    assert tally([found])["b"] == {expected: 1}


def test_few_worlds_have_no_verdict() -> None:
    found = group_of(a=LENGTHS[:5], b=[x + 5.0 for x in LENGTHS[:5]], c=LENGTHS[:5])
    assert verdict(found) == "5 cases are too few for a verdict (at least 6)."
    assert {finding(found, pair) for pair in found.pairs} == {Finding.OPEN}
    assert overall([found], "a") == NO_VERDICT
    assert not tally([found])


def test_optimizers_that_all_fail_are_not_called_equal() -> None:
    found = group_of(a=[math.inf] * 12, b=[math.inf] * 12, c=[math.inf] * 12)
    assert verdict(found) == "No run succeeds in any of 12 worlds: nothing to compare."
    assert {finding(found, pair) for pair in found.pairs} == {Finding.OPEN}
    assert not tally([found])
    assert overall([found], "a") == NO_VERDICT


def test_ranks_in_the_verdict() -> None:
    eight = LENGTHS[:8]  # of three, the critical difference is 1.17
    found = group_of(a=eight, b=[x + 1.0 for x in eight], c=[x + 1e-3 for x in eight])
    assert verdict(found).startswith(
        "The optimisers differ (Friedman, p = 0.0003); lowest mean rank: a, within the critical "
        "difference of it: c. Against a worse: b, c (by less than 1 point)"
    )
    assert verdict(group_of(a=LENGTHS, b=LENGTHS, c=LENGTHS)).startswith(
        "No difference between the 3 optimisers is shown (Friedman, p = 1.0000)."
    )
    assert overall([found], "a") == (
        "Against a, in 1 combinations of suite, planner and budget, 2 comparisons: better 0, "
        "worse 2, equal 0, open 0. A difference that is shown and may exceed 1 point of loss: "
        "1 of 2."
    )


def test_an_optimizer_that_always_fails_is_compared_as_such() -> None:
    found = group_of(a=LENGTHS, b=[math.inf] * 12)
    assert found.arms[1].loss.middle == 1.0
    assert found.arms[1].turning_rad is None
    assert finding(found, found.pairs[0]) is Finding.WORSE


def test_functions_are_compared_by_error_seed_by_seed() -> None:
    def searched(name: str, errors: list[float]) -> list[Row]:
        own = {"suite": "F1", "planner": "", "optimizer": name, "budget": 25}
        return [
            {**dict.fromkeys(TABLE), **own, "world": 0, "seed": k, "error": e,
             "outcome": "failed" if e == math.inf else "searched"}
            for k, e in enumerate(errors)
        ]  # fmt: skip

    a, b = [1e-13, 2.0, 3.0, 4.0, 5.0, 6.0], [1e-16, 3.0, 4.0, 5.0, 6.0, math.inf]
    (found,) = groups([*searched("a", a), *searched("b", b)], [], "a", oracle=True)
    assert (found.cases, found.arms[1].failed) == (6, 1)
    (pair,) = found.pairs
    assert (pair.paired.losses, pair.paired.ties, pair.effect) == (5, 1, -1.0)
    assert found.arms[0].errors == (2.0, 3.0, 5.0)
    assert found.arms[1].errors == (3.0, 4.0, 6.0)
    # Nearly equal errors are not called equal.
    (found,) = groups([*searched("a", a), *searched("b", a)], [], "a", oracle=True)
    assert finding(found, found.pairs[0]) is Finding.OPEN


def test_a_budget_is_a_multiple_of_the_population() -> None:
    assert with_budget(BatParams(), 25).iterations == 4
    for budget, near in ((27, 25), (5, 10), (0, 10), (-5, 10)):
        with pytest.raises(ConfigError, match=rf"--budget={budget}: not two or .* give {near}$"):
            with_budget(BatParams(), budget)


def test_arms_share_the_oracle_and_none_is_computed_once() -> None:
    spec = ComparisonSpec(
        sweeps=(SweepSpec(suite="random-3", planners=("paper", "predictive"), worlds=3),),
        optimizers=("mfba", "none"),
        budgets=(10, 25),
        against="mfba",
    )
    chunks = spec.chunks()
    assert len({chunk.name for chunk in chunks}) == len(chunks)
    assert sum(isinstance(chunk, OracleChunk) for chunk in chunks) == 1
    # Of two planners: mfba with two budgets, none with one.
    assert len(chunks) == 1 + 2 * (2 + 1)
    assert len(spec.arms()) == 8
