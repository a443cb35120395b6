# SPDX-License-Identifier: Apache-2.0
"""Ranks, critical differences and effect sizes against printed tables and direct formulas."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.evaluation.rank_tests import critical_difference, rank, rank_biserial

# Demsar 2006, Table 6: AUC of C4.5 and three variants on 14 data sets.
DEMSAR = np.array(
    [
        [0.763, 0.768, 0.771, 0.798],
        [0.599, 0.591, 0.590, 0.569],
        [0.954, 0.971, 0.968, 0.967],
        [0.628, 0.661, 0.654, 0.657],
        [0.882, 0.888, 0.886, 0.898],
        [0.936, 0.931, 0.916, 0.931],
        [0.661, 0.668, 0.609, 0.685],
        [0.583, 0.583, 0.563, 0.625],
        [0.775, 0.838, 0.866, 0.875],
        [1.000, 1.000, 1.000, 1.000],
        [0.940, 0.962, 0.965, 0.962],
        [0.619, 0.666, 0.614, 0.669],
        [0.972, 0.981, 0.9751, 0.975],
        [0.957, 0.978, 0.946, 0.970],
    ]
)


def test_the_worked_example_of_demsar() -> None:
    """Printed: mean ranks 3.143, 2.000, 2.893, 1.964, chi-square 9.28, and CD 1.25 (q 2.569)."""
    found = rank(-DEMSAR)
    assert found.mean == pytest.approx((3.143, 2.0, 2.893, 1.964), abs=5e-4)
    assert found.n == 14
    assert found.critical_difference == pytest.approx(2.569 * math.sqrt(20 / 84), rel=2e-4)
    # His chi-square lacks the correction for ties, which makes it larger.
    chi = 12 * 14 / 20 * (sum(r * r for r in found.mean) - 4 * 25 / 4)
    assert chi == pytest.approx(9.28, abs=0.01)
    assert found.p is not None
    assert found.p < chi_square_p(chi, 3)
    tied = sum(t**3 - t for t in (4, 2, 2, 2))  # rows of equal values
    assert found.p == pytest.approx(chi_square_p(chi / (1 - tied / (14 * 4 * 15)), 3), rel=1e-3)


def chi_square_p(x: float, degrees: int) -> float:
    """Upper tail for three degrees of freedom, in closed form."""
    assert degrees == 3
    return math.erfc(math.sqrt(x / 2)) + math.sqrt(2 * x / math.pi) * math.exp(-x / 2)


@pytest.mark.parametrize(
    ("methods", "q"), [(2, 1.960), (3, 2.343), (4, 2.569), (5, 2.728), (8, 3.031), (10, 3.164)]
)
def test_critical_differences_are_those_of_demsars_table_5(methods: int, q: float) -> None:
    expected = q * math.sqrt(methods * (methods + 1) / (6 * 30))
    assert critical_difference(methods, 30) == pytest.approx(expected, abs=3e-4)


def test_methods_that_are_all_equal_do_not_differ() -> None:
    found = rank(np.zeros((8, 4)))
    assert (found.mean, found.p) == ((2.5,) * 4, 1.0)


def test_two_methods_have_ranks_but_no_test_of_friedman() -> None:
    found = rank(np.array([[1.0, 2.0], [1.0, 2.0], [3.0, 3.0]]))
    assert found.p is None
    assert found.mean == pytest.approx((7 / 6, 11 / 6))


def test_rank_biserial_of_a_worked_example() -> None:
    """Kerby 2014, by hand: differences 1, -2, 3, 4 and a tie: ranks 1 + 3 + 4 against 2 of 10."""
    ours, other = np.array([0.0, 2.0, 0.0, 0.0, 5.0]), np.array([1.0, 0.0, 3.0, 4.0, 5.0])
    assert rank_biserial(ours, other) == pytest.approx((8 - 2) / 10)
    assert rank_biserial(other, ours) == pytest.approx(-(8 - 2) / 10)
    assert rank_biserial(ours, ours) == 0.0


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=1, max_size=12))
def test_rank_biserial_is_the_share_of_walsh_averages(pairs: list[tuple[int, int]]) -> None:
    """Without zeros, W+ counts the positive means of two differences (Tukey 1949)."""
    ours, other = np.array(pairs, dtype=float).T
    d = [b - a for a, b in zip(ours, other) if a != b]
    walsh = [np.sign(d[i] + d[j]) for i in range(len(d)) for j in range(i, len(d))]
    expected = np.mean(walsh) if walsh else 0.0
    assert rank_biserial(ours, other) == pytest.approx(expected, abs=1e-12)
