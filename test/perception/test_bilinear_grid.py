# SPDX-License-Identifier: Apache-2.0
"""Interpolation on a grid, against that of scipy; distances in a rectangle, against all points."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator

from mfba_planner.perception.bilinear_grid import BilinearGrid
from mfba_planner.perception.distance_field import DistanceField, distance_field

ORIGIN, CELL_M, CAP_M = (-1.0, 2.0), 0.25, 1.0


@settings(max_examples=50, deadline=None)
@given(st.integers(2, 9), st.integers(2, 7), st.integers(0, 99), st.booleans())
def test_between_the_middles_of_cells_it_is_bilinear_and_beyond_them_constant(
    width: int, height: int, seed: int, is_complex: bool
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(height, width))
    if is_complex:
        values = values + 1j * rng.normal(size=(height, width))
    x = ORIGIN[0] + (np.arange(width) + 0.5) * CELL_M
    y = ORIGIN[1] + (np.arange(height) + 0.5) * CELL_M
    peer = RegularGridInterpolator((y, x), values)
    at = rng.uniform(-3.0, 6.0, size=(2, 40))
    inside = np.clip(at, [[x[0]], [y[0]]], [[x[-1]], [y[-1]]])
    grid = BilinearGrid(values, ORIGIN, CELL_M)
    found = grid.at(at)
    assert found == pytest.approx(peer(inside[::-1].T), abs=1e-6)
    assert [grid.at_one(*one) for one in at.T.tolist()] == pytest.approx(found)


@settings(max_examples=60, deadline=None)
@example([(-0.09375, 0.0), (-0.015625, 0.0)], (0.0, 0.0), (1.0, 1.0))  # both in one cell
@given(
    st.lists(st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)), min_size=1, max_size=30),
    st.tuples(st.floats(-5.0, 2.0), st.floats(-5.0, 2.0)),
    st.tuples(st.floats(0.1, 6.0), st.floats(0.1, 6.0)),
)
def test_distances_in_a_rectangle_are_those_to_the_nearest_point(
    points: list[tuple[float, float]], low: tuple[float, float], size: tuple[float, float]
) -> None:
    """Also where points are far from it, or only on one side."""
    high = (low[0] + size[0], low[1] + size[1])
    cell_m = 0.1
    x, y = np.array(points).T
    field = distance_field(x, y, low, high, cell_m, CAP_M)
    height, width = field.distance_m.shape
    at_x = field.origin_m[0] + (np.arange(width) + 0.5) * cell_m
    at_y = field.origin_m[1] + (np.arange(height)[:, None] + 0.5) * cell_m
    true = np.sqrt((at_x[..., None] - x) ** 2 + (at_y[..., None] - y) ** 2).min(axis=-1)
    assert field.distance_m == pytest.approx(np.minimum(true, CAP_M), abs=1.42 * cell_m)
    assert (field.distance_m >= np.minimum(true, CAP_M) - 1e-5).all()


def test_a_field_is_bilinear_between_the_middles_and_the_cap_beyond_them() -> None:
    """The last middles are outside: there is no cell beyond them."""
    values = np.array([[0.0, 0.25, 0.5], [0.5, 0.0, 0.75]])
    field = DistanceField((0.0, 0.0), 1.0, values, CAP_M)
    x = np.array([0.5, 1.0, 1.0, 2.25, 0.49, 1.0, 2.5, 1.0, 1.0])
    y = np.array([0.5, 0.5, 1.0, 0.5, 0.75, 0.49, 1.0, 1.5, 1.6])
    expected = [0.0, 0.125, 0.1875, 0.4375, *(CAP_M,) * 5]
    assert field.at(x, y) == pytest.approx(expected)
    for one_x, one_y, one in zip(x, y, expected):  # inside alone, and outside alone
        assert field.at(np.array([one_x]), np.array([one_y])) == pytest.approx([one])
