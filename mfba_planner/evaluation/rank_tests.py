# SPDX-License-Identifier: Apache-2.0
"""Ranks of several methods on the same cases: Friedman's test, critical difference, effect size.

scipy is imported where it is used, as in statistics.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .statistics import LEVEL, Array

FEWEST_RANKED = 3  # methods in Friedman's test


@dataclass(frozen=True, slots=True)
class Ranks:
    """Mean ranks of k methods over n cases (1 is best) and Friedman's p, corrected for ties.

    Two methods whose mean ranks differ by less than critical_difference cannot be distinguished
    (Nemenyi 1963, 95 %). p is None for less than three methods.
    """

    mean: tuple[float, ...]
    n: int
    p: float | None
    critical_difference: float


def rank(losses: Array) -> Ranks:
    """Rank methods by their losses, shape (n cases, k methods), lower is better."""
    from scipy.stats import friedmanchisquare, rankdata

    ranks = rankdata(losses, axis=1)
    n, k = ranks.shape
    p = None
    if k >= FEWEST_RANKED:
        # With all ranks tied the statistic is 0 / 0.
        tied = bool((ranks == ranks[:, :1]).all())
        p = 1.0 if tied else float(friedmanchisquare(*ranks.T).pvalue)
    return Ranks(tuple(float(r) for r in ranks.mean(axis=0)), n, p, critical_difference(k, n))


def critical_difference(methods: int, cases: int) -> float:
    """Nemenyi's critical difference of mean ranks (Demsar 2006, eq. for CD), 95 %."""
    from scipy.stats import studentized_range

    q = float(studentized_range.ppf(LEVEL, methods, math.inf)) / math.sqrt(2.0)
    return q * math.sqrt(methods * (methods + 1) / (6.0 * cases))


def rank_biserial(ours: Array, other: Array) -> float:
    """Effect size of Wilcoxon's test of pairs (Kerby 2014), in [-1, 1]; lower losses are better.

    1: ours is better in every case that is not a tie; 0: neither is.
    """
    from scipy.stats import rankdata

    difference = np.asarray(other, dtype=float) - np.asarray(ours, dtype=float)
    difference = difference[difference != 0.0]
    if not len(difference):
        return 0.0
    ranks = rankdata(abs(difference))
    return float((ranks * np.sign(difference)).sum() / ranks.sum())
