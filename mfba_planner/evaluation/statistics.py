# SPDX-License-Identifier: Apache-2.0
"""Statistics of samples of runs: intervals, comparisons, consistency of printed rows.

scipy is imported where it is used: its import takes longer than most commands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEVEL = 0.95
RESAMPLES = 10_000
RIDGE = 1e-6
DRAWN = 2**20  # resampled values in memory at once


def generator(*key: int) -> np.random.Generator:
    """The random generator of one resampling, named by numbers; reproducible."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(0, spawn_key=key)))


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its 95 % interval."""

    middle: float
    low: float
    high: float

    def __contains__(self, value: float) -> bool:
        """Whether a value lies inside, ends included."""
        return self.low <= value <= self.high


def interval(values: Array, middle: float | None = None) -> Interval:
    """Median (or the middle given) and central 95 % of resampled values."""
    tail = 50.0 * (1.0 - LEVEL)
    low, half, high = np.percentile(values, [tail, 50.0, 100.0 - tail])
    return Interval(float(half if middle is None else middle), float(low), float(high))


def resample(sample: Array, size: int, rng: np.random.Generator, count: int = RESAMPLES) -> Array:
    """Draw count times size of the sample's values, with replacement: (count, size)."""
    return np.asarray(sample)[rng.integers(len(sample), size=(count, size))]


def four(draws: Array) -> Array:
    """(best, worst, mean, sd) of each row of draws, sd over n - 1: (count, 4)."""
    return np.stack([draws.min(1), draws.max(1), draws.mean(1), draws.std(1, ddof=1)], axis=1)


def estimate(
    sample: Array,
    statistic: Callable[[Array], Array],
    rng: np.random.Generator,
    count: int = 1000,
) -> Interval:
    """A statistic of the whole sample with its bootstrap interval.

    statistic takes (count, n) and returns (count,).
    """
    found = statistic(np.asarray(sample)[None, :])[0]
    return interval(statistic(resample(sample, len(sample), rng, count)), float(found))


def rate(count: int, n: int) -> Interval:
    """Share count / n of independent cases with Wilson's 95 % interval; n >= 1."""
    return Interval(count / n, *share_interval(count, n))


def mean(sample: Array, rng: np.random.Generator, count: int = 2000) -> Interval:
    """Mean with its percentile bootstrap interval; memory is bounded."""
    values = np.asarray(sample, dtype=float)
    batch = max(1, DRAWN // len(values))
    means = [
        resample(values, len(values), rng, min(batch, count - start)).mean(1)
        for start in range(0, count, batch)
    ]
    return interval(np.concatenate(means), float(values.mean()))


@dataclass(frozen=True, slots=True)
class Paired:
    """Paired comparison of two planners on the same cases, lower is better.

    difference is the mean of ours - other with its bootstrap interval over the cases; sign_p is
    the exact sign test's p (ties left out), rank_p Wilcoxon's, both two-sided.
    """

    n: int
    wins: int
    losses: int
    difference: Interval
    sign_p: float
    rank_p: float

    @property
    def ties(self) -> int:
        """Cases in which both are equal."""
        return self.n - self.wins - self.losses


def paired(ours: Array, other: Array, rng: np.random.Generator) -> Paired:
    """Compare values of the same cases, paired by index; at least one case."""
    from scipy.stats import binomtest, wilcoxon

    difference = np.asarray(ours, dtype=float) - np.asarray(other, dtype=float)
    wins, losses = int((difference < 0.0).sum()), int((difference > 0.0).sum())
    decided = wins + losses
    return Paired(
        n=len(difference),
        wins=wins,
        losses=losses,
        difference=mean(difference, rng),
        sign_p=float(binomtest(wins, decided).pvalue) if decided else 1.0,
        rank_p=_probability(wilcoxon(difference, method="asymptotic").pvalue) if decided else 1.0,
    )


def mean_difference(
    ours: Array, other: Array, rng: np.random.Generator, count: int = 1000
) -> Interval:
    """Mean of ours minus mean of another, independent sample, with its bootstrap interval."""
    drawn = [resample(sample, len(sample), rng, count).mean(1) for sample in (ours, other)]
    return interval(drawn[0] - drawn[1], float(np.mean(ours) - np.mean(other)))


@dataclass(frozen=True, slots=True)
class Consistency:
    """Fit of a printed row: joint p; outside names the statistics beyond their own interval."""

    p: float
    outside: tuple[str, ...]

    @property
    def consistent(self) -> bool:
        """Whether the row fits at the 95 % level."""
        return self.p >= 1.0 - LEVEL


def consistency(draws: Array, printed: Sequence[float], names: Sequence[str]) -> Consistency:
    """Whether printed statistics, jointly, could be a row of draws (count, k).

    Each statistic becomes a normal score by its rank among the draws; the distance is
    Mahalanobis's, so that correlated statistics must agree in print too, and p is the share of
    draws at least as far out. A value beyond all draws gets the score of the outermost rank.
    """
    from scipy.special import ndtri

    count, k = draws.shape
    scores = np.empty((count + 1, k))
    for j, value in enumerate(printed):
        column = np.sort(draws[:, j])
        for rows, x in ((slice(0, count), draws[:, j]), (slice(count, None), np.array([value]))):
            below = np.searchsorted(column, x, "left")
            not_above = np.searchsorted(column, x, "right")
            scores[rows, j] = ndtri((0.5 * (below + not_above) + 0.5) / (count + 1))
    # Without the ridge a constant column would accept any printed value.
    spread = np.cov(scores[:count].T) + RIDGE * np.eye(k)
    squared = np.einsum("ij,jk,ik->i", scores, np.linalg.inv(spread), scores)
    p = (1 + np.count_nonzero(squared[:count] >= squared[count])) / (count + 1)
    outside = [
        name
        for j, (name, value) in enumerate(zip(names, printed))
        if value not in interval(draws[:, j])
    ]
    return Consistency(float(p), tuple(outside))


@dataclass(frozen=True, slots=True)
class Comparison:
    """Chance that a run of one beats a run of the other (a tie counts half), and its p."""

    superiority: Interval
    p: float


def compare(ours: Array, other: Array) -> Comparison:
    """Mann-Whitney's U of two independent samples, lower is better; two-sided p.

    The superiority is U / (n m); its interval is DeLong's, from the placements.
    """
    from scipy.stats import mannwhitneyu

    n, m = len(ours), len(other)
    test = mannwhitneyu(other, ours, alternative="two-sided", method="asymptotic")
    share = float(test.statistic) / (n * m)
    deviation = np.sqrt(
        _placements(ours, other).var(ddof=1) / n + _placements(other, ours).var(ddof=1) / m
    )
    return Comparison(_normal(share, float(deviation)), _probability(test.pvalue))


def _placements(x: Array, y: Array) -> Array:
    """For each x the share of y above it; ties count half."""
    ordered = np.sort(y)
    below = np.searchsorted(ordered, x, "left") + np.searchsorted(ordered, x, "right")
    return 1.0 - 0.5 * below / len(y)


def compare_pairs(ours: Array, other: Array) -> Comparison:
    """Wilcoxon's signed ranks of runs with equal seeds, lower is better; two-sided p.

    The superiority is the share of pairs won, a tie half, with Wilson's interval.
    """
    from scipy.stats import wilcoxon

    difference = np.asarray(ours) - np.asarray(other)
    won = np.count_nonzero(difference < 0.0) + 0.5 * np.count_nonzero(difference == 0.0)
    n = len(difference)
    low, high = share_interval(round(won), n)
    p = 1.0 if not difference.any() else wilcoxon(difference, method="asymptotic").pvalue
    return Comparison(Interval(float(won / n), low, high), _probability(p))


def share_interval(count: int, n: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share count / n (Wilson 1927).

    Implemented here, since the import of scipy.stats takes longer than many sweeps.
    """
    z = NormalDist().inv_cdf(0.5 + 0.5 * LEVEL)
    share, scale = count / n, 2.0 * (n + z * z)
    center = (2.0 * count + z * z) / scale
    reach = z * math.sqrt(z * z + 4.0 * count * (1.0 - share)) / scale
    return center - reach if count else 0.0, center + reach if count < n else 1.0


def holm(p: Sequence[float]) -> list[float]:
    """Holm's corrected p-values, in the sequence given."""
    corrected = [0.0] * len(p)
    worst = 0.0
    for rank, index in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        worst = max(worst, min(1.0, (len(p) - rank) * p[index]))
        corrected[index] = worst
    return corrected


def _normal(middle: float, deviation: float) -> Interval:
    from scipy.special import ndtri

    reach = float(ndtri(0.5 + 0.5 * LEVEL)) * deviation
    return Interval(middle, max(0.0, middle - reach), min(1.0, middle + reach))


def _probability(p: float) -> float:
    """A p-value; 1 for NaN (two constant samples)."""
    return 1.0 if np.isnan(p) else float(p)
