# SPDX-License-Identifier: Apache-2.0
"""Functions of Table 2: independent values, minima, symmetries, floats against arrays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.paper.benchmark_functions import FUNCTIONS, Function

ALL = [pytest.param(function, id=key) for key, function in FUNCTIONS.items()]
FLAT = {"F2", "F3", "F4"}  # only two dimensions


def uniform(function: Function, d: int, count: int, seed: int = 3) -> np.ndarray:
    rng = np.random.Generator(np.random.PCG64(seed))
    return rng.uniform(function.lower, function.upper, (count, d))


# Computed by hand, or with another program, from the printed formulas.
@pytest.mark.parametrize(
    ("key", "x", "value"),
    [
        ("F1", (1.0, -2.0, 3.0), 14.0),
        ("F2", (3.0, 3.0), -(math.cos(3.0) ** 2) * math.exp(-2.0 * (3.0 - math.pi) ** 2)),
        ("F2", (0.0, 0.0), -math.exp(-2.0 * math.pi**2)),
        ("F3", (1.0, 1.0), 2.0 - 1.05 + 1.0 / 6.0 + 1.0 + 1.0),
        ("F3", (2.0, -1.0), 8.0 - 16.8 + 64.0 / 6.0 - 2.0 + 1.0),
        ("F4", (0.0, 0.0), 74.0),
        ("F4", (-2.0, 4.0), 1.0 + 25.0),
        ("F5", (0.5, 0.0), 20.25),
        ("F5", (1.0, 1.0, 1.0), 3.0),
        ("F5", (4.5,), 10.0 + 20.25 + 10.0),
        ("F6", (math.pi / 2.0, math.pi / 2.0), -(math.sin(math.pi / 4.0) ** 20) - 1.0),
        (
            "F6",
            (1.0, 2.0),
            -math.sin(1.0) * math.sin(1.0 / math.pi) ** 20
            - math.sin(2.0) * math.sin(8.0 / math.pi) ** 20,
        ),
    ],
)
def test_values_by_hand(key: str, x: tuple[float, ...], value: float) -> None:
    assert FUNCTIONS[key](x) == pytest.approx(value, rel=1e-7)


# Michalewicz, m = 10: Molga & Smutnicki (2005) for d = 2, 5, 10; Vanaret et al. (2014), proven.
@pytest.mark.parametrize(
    ("d", "value"), [(2, -1.8013034), (5, -4.687658), (10, -9.6601517), (20, -19.6370136)]
)
def test_published_minima_of_michalewicz(d: int, value: float) -> None:
    assert FUNCTIONS["F6"].minimum(d) == pytest.approx(value, abs=6e-8 if d == 2 else 6e-7)
    at = FUNCTIONS["F6"].minimizers(d)[0]
    assert at[:2] == pytest.approx((2.2029055, 1.5707963), abs=1e-7)


@pytest.mark.parametrize("function", ALL)
def test_minima_as_printed_in_table_2(function: Function) -> None:
    printed = {"F1": 0.0, "F2": -1.0, "F3": 0.0, "F4": 0.0, "F5": 0.0, "F6": -1.8013}
    assert round(function.minimum(), 4) == printed[function.key]


@pytest.mark.parametrize("function", ALL)
@pytest.mark.parametrize("d", [1, 2, 3, 6])
def test_no_value_in_the_range_is_below_the_minimum(function: Function, d: int) -> None:
    if function.key in FLAT and d != 2:
        with pytest.raises(ConfigError):
            function.minimum(d)
        return
    least, box = function.minimum(d), function.box(d)
    for point in function.minimizers(d):
        assert box.clamp(list(point)) == list(point)
        assert function(point) == pytest.approx(least, abs=1e-15)
        near = np.array(point) + uniform(function, d, 4000) * 1e-3
        assert function.batch(near).min() >= least - 1e-15
    assert function.batch(uniform(function, d, 20_000)).min() >= least


@pytest.mark.parametrize("d", range(1, 31))
def test_each_coordinate_of_michalewicz_is_the_best_of_a_fine_grid(d: int) -> None:
    v = np.linspace(0.0, math.pi, 200_001)
    term = np.sin(v) * np.sin(d * v * v / math.pi) ** 20
    at = FUNCTIONS["F6"].minimizers(d)[0][d - 1]
    assert at == pytest.approx(v[term.argmax()], abs=2e-5)


@pytest.mark.parametrize("function", ALL)
def test_the_slope_vanishes_at_the_minimum(function: Function) -> None:
    for point in function.minimizers():
        for j in (0, 1):
            step = np.zeros(2)
            step[j] = 1e-5
            up, down = function((point + step).tolist()), function((point - step).tolist())
            assert (up - down) / 2e-5 == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("function", ALL)
def test_arrays_and_floats_agree(function: Function) -> None:
    for d in (2,) if function.key in FLAT else (1, 2, 5):
        x = uniform(function, d, 500)
        values = function.batch(x)
        # sin, cos and exp of numpy and of math may differ in the last bit
        assert values == pytest.approx([function(p) for p in x.tolist()], rel=1e-12, abs=1e-12)
        assert function.batch(x.reshape(5, 100, d)).tolist() == values.reshape(5, 100).tolist()
        if function.key in ("F1", "F3", "F4"):
            assert values.tolist() == [function(p) for p in x.tolist()], "only + and *: same bits"


@given(st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=5))
def test_symmetries(x: list[float]) -> None:
    f1, f5, f2, f3 = (FUNCTIONS[key] for key in ("F1", "F5", "F2", "F3"))
    mirrored = [-v for v in x]
    for function in (f1, f5):
        assert function(mirrored) == function(x)
        assert function(x[::-1]) == pytest.approx(function(x), rel=1e-12, abs=1e-12)
    assert f3(mirrored[:2]) == f3(x[:2])
    assert f2(x[1::-1]) == pytest.approx(f2(x[:2]), rel=1e-9, abs=1e-300)


def test_far_outside_a_batch_gives_nan_or_inf_and_no_warning() -> None:
    for function in FUNCTIONS.values():
        values = function.batch(np.array([[math.inf, 1.0], [1e300, 1e300], [math.nan, 1.0]]))
        assert values.shape == (3,)


def test_impossible_dimensions_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"^F1 \(Sphere\): d=0; give d >= 1$"):
        FUNCTIONS["F1"].box(0)
    with pytest.raises(ConfigError, match=r"^F4 \(Booth\): d=3; it has d = 2$"):
        FUNCTIONS["F4"].minimizers(3)


def test_ranges_as_printed() -> None:
    assert FUNCTIONS["F5"].box(3).span() == ([-5.12] * 3, [5.12] * 3)
    assert FUNCTIONS["F6"].box().span() == ([0.0, 0.0], [math.pi, math.pi])
    assert [f.kind for f in FUNCTIONS.values()] == list("UUMUMM")
