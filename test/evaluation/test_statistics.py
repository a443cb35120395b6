# SPDX-License-Identifier: Apache-2.0
"""Statistics against textbook values, exact enumeration and random samples."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.evaluation import statistics as stats

NAMES = ("best", "worst", "mean", "sd")


def test_four_statistics_of_a_row() -> None:
    (row,) = stats.four(np.array([[3.0, 1.0, 2.0]]))
    assert row.tolist() == [1.0, 3.0, 2.0, 1.0]


def test_interval_is_the_central_95_percent() -> None:
    found = stats.interval(np.arange(1001.0))
    assert (found.low, found.middle, found.high) == pytest.approx((25.0, 500.0, 975.0))
    assert found.high in found
    assert 24.9 not in found


def test_resampling_draws_each_value_equally_and_is_the_same_each_time() -> None:
    sample = np.array([1.0, 2.0, 3.0])
    drawn = stats.resample(sample, 10, stats.generator(1))
    assert drawn.shape == (10_000, 10)
    shares = [float(np.mean(drawn == value)) for value in sample]
    assert shares == pytest.approx([1 / 3] * 3, abs=0.01)
    assert (drawn == stats.resample(sample, 10, stats.generator(1))).all()
    assert (drawn != stats.resample(sample, 10, stats.generator(2))).any()


def test_bootstrap_interval_of_a_mean_equals_the_normal_one() -> None:
    sample = np.random.default_rng(5).normal(3.0, 2.0, 400)
    found = stats.estimate(sample, lambda x: x.mean(1), stats.generator(1), 4000)
    reach = 1.96 * sample.std(ddof=1) / 20
    assert found.middle == sample.mean()
    assert found.low == pytest.approx(sample.mean() - reach, abs=0.02)
    assert found.high == pytest.approx(sample.mean() + reach, abs=0.02)


def test_superiority_counts_pairs() -> None:
    ours, other = np.array([1.0, 2.0, 5.0, 5.0]), np.array([2.0, 3.0, 5.0])
    wins = [1.0 if a < b else 0.5 if a == b else 0.0 for a, b in product(ours, other)]
    assert stats.compare(ours, other).superiority.middle == pytest.approx(np.mean(wins))
    assert stats.compare(other, ours).superiority.middle == pytest.approx(1 - np.mean(wins))


def test_mann_whitney_as_in_the_textbook() -> None:
    # Siegel (1956): U = 64 of 16 x 23 pairs, z = 3.43 with ties corrected, p = .0003 one-sided
    oral_absent = [13, 12, 12, 10, 10, 10, 10, 9, 8, 8, 7, 7, 7, 7, 7, 6]
    oral_present = [17, 16, 15, 15, 15, 14, 14, 14, 13, 13, 13, 12, 12, 12, 12, 11, 11, 10, 10,
                    10, 8, 8, 6]  # fmt: skip
    found = stats.compare(np.array(oral_absent, float), np.array(oral_present, float))
    assert found.superiority.middle == pytest.approx(1 - 64 / (16 * 23))
    assert found.p == pytest.approx(2 * 0.0003, abs=1.2e-4)


def test_the_false_positive_rate_is_as_specified() -> None:
    rng = np.random.default_rng(1)
    found = [stats.compare(rng.random(30), rng.random(40)) for _ in range(400)]
    assert sum(c.p < 0.05 for c in found) < 35  # 20 expected
    assert sum(0.5 in c.superiority for c in found) > 360  # 380 expected


def test_constant_samples_are_equal() -> None:
    same = stats.compare(np.zeros(5), np.zeros(6))
    assert (same.superiority.middle, same.p) == (0.5, 1.0)
    pairs = stats.compare_pairs(np.zeros(5), np.zeros(5))
    assert (pairs.superiority.middle, pairs.p) == (0.5, 1.0)


def test_pairs_by_their_signed_ranks() -> None:
    ours, other = np.array([1.0, 2.0, 3.0, 9.0]), np.array([2.0, 4.0, 3.0, 8.5])
    assert stats.compare_pairs(ours, other).superiority.middle == 2.5 / 4
    rng = np.random.default_rng(2)
    common = rng.normal(0.0, 10.0, 200)
    shifted = stats.compare_pairs(common - 0.2 + rng.normal(0.0, 0.5, 200), common)
    assert shifted.p < 0.001  # unpaired, the shift drowns in the common part
    assert stats.compare(common - 0.2, common).p > 0.5


def test_wilson_s_interval() -> None:
    # Newcombe (1998), table I: 81 of 263, and 0 of 20
    assert stats.share_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert stats.share_interval(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)


def test_holm_as_by_hand() -> None:
    assert stats.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert stats.holm([0.9, 0.8]) == [1.0, 1.0]


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=10))
def test_holm_never_lowers_p_and_keeps_the_ranking(p: list[float]) -> None:
    corrected = stats.holm(p)
    assert all(a <= b <= 1.0 for a, b in zip(p, corrected))
    assert all(x <= y for (a, x), (b, y) in product(zip(p, corrected), repeat=2) if a < b)


def fifteen(rng: np.random.Generator, count: int) -> np.ndarray:
    return stats.four(rng.lognormal(0.0, 1.5, (count, 15)))


def test_rows_of_the_same_law_are_refused_one_time_in_twenty() -> None:
    rng = np.random.default_rng(3)
    draws = fifteen(rng, 2000)
    found = [stats.consistency(draws, row, NAMES) for row in fifteen(rng, 300).tolist()]
    refused = sum(not c.consistent for c in found)
    assert 5 <= refused <= 28  # 15 expected


def test_rows_of_another_law_are_refused() -> None:
    rng = np.random.default_rng(4)
    draws = fifteen(rng, 2000)
    other = stats.four(10.0 * rng.lognormal(0.0, 0.5, (100, 15)))
    found = [stats.consistency(draws, row, NAMES) for row in other.tolist()]
    assert sum(not c.consistent for c in found) > 95
    assert "best" in found[0].outside


def test_numbers_that_fit_one_by_one_but_not_together_are_refused() -> None:
    draws = fifteen(np.random.default_rng(6), 4000)
    low = [float(np.percentile(draws[:, j], 10)) for j in range(4)]
    high = [float(np.percentile(draws[:, j], 90)) for j in range(4)]
    contrary = [low[0], low[1], low[2], high[3]]  # small worst and mean, large deviation
    found = stats.consistency(draws, contrary, NAMES)
    assert found.outside == ()
    assert found.p < 0.01


def test_joint_p_is_that_of_the_normal_distribution_where_the_rows_are_normal() -> None:
    rng = np.random.default_rng(7)
    spread = np.array([[1.0, 0.8], [0.8, 1.0]])
    draws = rng.multivariate_normal([0.0, 0.0], spread, 8000)
    point = np.array([1.5, -0.2])
    squared = point @ np.linalg.inv(spread) @ point
    assert stats.consistency(draws, point.tolist(), ("a", "b")).p == pytest.approx(
        math.exp(-squared / 2), abs=0.02
    )


def test_a_constant_statistic_accepts_no_other_value() -> None:
    draws = np.zeros((500, 4))
    assert stats.consistency(draws, [0.0] * 4, NAMES).p == 1.0
    found = stats.consistency(draws, [-0.8, 0.0, -0.1, 0.2], NAMES)
    assert found.p < 0.01
    assert found.outside == ("best", "mean", "sd")


def test_a_rate_has_wilson_s_interval() -> None:
    # 10 of 10: Wilson's lower end is n / (n + z^2)
    z = 1.959963984540054
    found = stats.rate(10, 10)
    assert (found.middle, found.high) == (1.0, 1.0)
    assert found.low == pytest.approx(10.0 / (10.0 + z * z))
    half = stats.rate(50, 100)
    assert (half.low, half.high) == pytest.approx((0.4038315, 0.5961685), abs=1e-6)
    assert stats.rate(0, 5).low == 0.0


def test_a_mean_s_interval_holds_the_truth_nineteen_times_in_twenty() -> None:
    rng = np.random.default_rng(0)
    held = 0
    for k in range(200):
        found = stats.mean(rng.exponential(2.0, 100), stats.generator(k), 400)
        held += 2.0 in found
    assert 175 <= held <= 199


def test_resampling_a_mean_in_batches_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    sample = np.random.default_rng(1).normal(size=50)
    whole = stats.mean(sample, stats.generator(3))
    monkeypatch.setattr(stats, "DRAWN", 120)  # two resamples at a time
    assert stats.mean(sample, stats.generator(3)) == whole
    assert stats.mean(np.array([4.0]), stats.generator(3)) == stats.Interval(4.0, 4.0, 4.0)


def test_pairs_that_are_all_won() -> None:
    ours, other = np.arange(10.0), np.arange(10.0) + np.linspace(0.1, 1.0, 10)
    found = stats.paired(ours, other, stats.generator(1))
    assert (found.n, found.wins, found.losses, found.ties) == (10, 10, 0, 0)
    assert found.difference.middle == pytest.approx(-0.55)
    assert found.difference.high < 0.0
    assert found.sign_p == pytest.approx(2.0 / 2**10), "both tails of ten heads"
    assert found.rank_p < 0.01


def test_ties_count_for_neither() -> None:
    other = np.zeros(6)
    found = stats.paired(np.array([0.0, 0.0, 0.0, -1.0, -1.0, 1.0]), other, stats.generator(1))
    assert (found.wins, found.losses, found.ties) == (2, 1, 3)
    assert found.sign_p == 1.0
    same = stats.paired(other, other, stats.generator(1))
    assert (same.sign_p, same.rank_p, same.difference.low) == (1.0, 1.0, 0.0)


def test_equal_samples_are_rarely_significant() -> None:
    rng = np.random.default_rng(2)
    small = [
        stats.paired(rng.normal(size=40), rng.normal(size=40), stats.generator(k))
        for k in range(100)
    ]
    assert sum(found.sign_p < 0.05 for found in small) <= 10
    assert sum(found.rank_p < 0.05 for found in small) <= 12
    assert sum(0.0 not in found.difference for found in small) <= 14
