# SPDX-License-Identifier: Apache-2.0
"""The printed numbers; each impossible one is recomputed by other formulas."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.paper import impossible_numbers, published
from mfba_planner.paper.benchmark_functions import FUNCTIONS
from mfba_planner.paper.published import BY_KEY, values


def test_every_number_of_the_tables_has_a_unique_key() -> None:
    count = {
        place: sum(p.place == place for p in published.ALL)
        for place in (f"Table {n}" for n in range(1, 8))
    }
    # Table 3: 6 functions x 2 algorithms x 4 numbers, and 6 signs.
    assert count == {
        "Table 1": 4,
        "Table 2": 30,
        "Table 3": 54,
        "Table 4": 15,
        "Table 5": 8,
        "Table 6": 25,
        "Table 7": 8,
    }
    assert len(BY_KEY) == len(published.ALL)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("Table 3/F2 BA/worst", "-9.64e-32"),
        ("Table 3/F2 MFBA/mean", "-0.2090"),
        ("Table 3/F4 MFBA/best", "2.7530e-05"),
        ("Table 3/F6 MFBA/significant", "+"),
        ("Table 5/BA/mean", "0.05751639825"),
        ("Table 5/MFBA/standard deviation", "0.05315157"),
        ("Table 7/MFBA/maximum", "0.054486114"),
        ("Table 6/1/theta", "111.8"),
        ("Section 6.2/optimum/length", "16.9705"),
        ("Section 6.2, case 1/MFBA/run time", "8.151829"),
    ],
)
def test_texts_are_as_printed(key: str, text: str) -> None:
    assert BY_KEY[key].text == text


def test_values_are_those_of_the_texts() -> None:
    for printed in published.ALL:
        if re.fullmatch(r"-?\d[\d.]*(e-?\d+)?", printed.text) and printed.column != "formula":
            assert printed.value == float(printed.text), printed.key
        else:
            assert printed.value in (None, math.pi), printed.key


def test_the_impossible_numbers_are_exactly_these() -> None:
    assert set(impossible_numbers.IMPOSSIBLE) == {
        "Table 3/F4 MFBA/sd",
        "Table 3/F6 BA/best",
        "Table 3/F6 MFBA/best",
        "Table 3/F6 MFBA/mean",
        "Table 5/MFBA/standard deviation",
        "Table 7/BA/standard deviation",
        "Table 7/MFBA/standard deviation",
    }
    assert set(impossible_numbers.CONTRADICTED) == {
        "Section 6.2, case 1/MFBA/length",
        "Table 5/MFBA/maximum",
        "Section 6.2/optimum/length",
    }


@pytest.mark.parametrize(
    ("place", "law"), [("Table 5", "MFBA"), ("Table 7", "BA"), ("Table 7", "MFBA")]
)
def test_deviations_of_trips_exceed_popoviciu_and_bhatia_davis(place: str, law: str) -> None:
    v = values(place, law)
    low, high, mean, sd = v["minimum"], v["maximum"], v["mean"], v["standard deviation"]
    to_sample = math.sqrt(10 / 9)
    assert sd > 100 * to_sample * (high - low) / 2
    assert sd > 100 * to_sample * math.sqrt((high - mean) * (mean - low))


def test_the_other_deviation_of_table_5_is_possible() -> None:
    v = values("Table 5", "BA")
    ten = [v["minimum"]] * 4 + [v["maximum"]] * 6
    assert np.std(ten, ddof=1) > v["standard deviation"]


def test_the_deviation_of_f4_is_too_small_for_its_ends() -> None:
    v = values("Table 3", "F4 MFBA")
    # Both ends are among the fifteen, so their squares alone are a lower bound.
    ends = (v["best"] - v["mean"]) ** 2 + (v["worst"] - v["mean"]) ** 2
    assert math.sqrt(ends / 15) > v["sd"] * 1.1
    assert math.sqrt(ends / 14) > v["sd"] * 1.1


def test_the_best_values_of_f6_are_below_its_minimum() -> None:
    grid = np.linspace(0.0, math.pi, 2001)
    points = np.stack(np.meshgrid(grid, grid), axis=-1)
    least = float(FUNCTIONS["F6"].batch(points).min())
    assert least == pytest.approx(-1.8013, abs=1e-4)
    for key in ("F6 BA/best", "F6 MFBA/best", "F6 MFBA/mean"):
        assert float(BY_KEY[f"Table 3/{key}"].text) < least - 0.05
    assert float(BY_KEY["Table 3/F6 BA/mean"].text) > least


def test_table_5_and_the_text_disagree() -> None:
    assert f"{1 / values('Table 5', 'MFBA')['maximum']:.4f}" == "17.0919"
    assert f"{1 / values('Table 5', 'BA')['maximum']:.4f}" == "17.0932"
    assert f"{1 / values('Table 7', 'MFBA')['maximum']:.4f}" == "18.3533"
    assert f"{1 / values('Table 7', 'BA')['maximum']:.4f}" == "18.6239"


numbers = st.lists(st.floats(-1e3, 1e3, allow_nan=False), min_size=3, max_size=20)


@given(numbers)
def test_every_sample_is_within_the_bounds(sample: list[float]) -> None:
    low, high, mean = min(sample), max(sample), float(np.mean(sample))
    if high - low < 1e-6:
        return
    n = len(sample)
    slack = 1e-9 * (high - low) + 1e-9
    assert np.std(sample, ddof=1) <= impossible_numbers.largest_sd(n, low, high, mean) + slack
    assert np.std(sample) >= impossible_numbers.smallest_sd(n, low, high, mean) - slack


@given(st.integers(3, 30), st.floats(0.05, 0.95))
def test_the_bounds_are_reached(n: int, share: float) -> None:
    at_high = max(1, min(n - 1, round(share * n)))
    ends = [0.0] * (n - at_high) + [1.0] * at_high
    mean = at_high / n
    assert impossible_numbers.largest_sd(n, 0.0, 1.0, mean) == pytest.approx(np.std(ends, ddof=1))
    middle = [0.0, 1.0] + [share] * (n - 2)
    assert impossible_numbers.smallest_sd(n, 0.0, 1.0, float(np.mean(middle))) == pytest.approx(
        np.std(middle)
    )
