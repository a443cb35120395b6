# SPDX-License-Identifier: Apache-2.0
"""Points of the local map and distances to them, against brute force."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.perception.distance_field import distance_field
from mfba_planner.perception.static_map_points import HITS, NONE, MapPoints, X, Y

CELL_M, SIZE_M = 0.05, 4.0


def added(points: MapPoints, x: np.ndarray, y: np.ndarray) -> int:
    return points.add(x, y, 0.0, np.zeros(x.size), np.ones(x.size), np.zeros(x.size))


def brute_force(points: MapPoints, x: float, y: float) -> float:
    return float(np.hypot(points.data[X] - x, points.data[Y] - y).min(initial=math.inf))


@given(seed=st.integers(0, 2**32 - 1), steps=st.integers(1, 12))
@settings(max_examples=60, deadline=None)
def test_points_are_found_after_any_changes(seed: int, steps: int) -> None:
    rng = np.random.default_rng(seed)
    points, center = MapPoints(CELL_M, SIZE_M), np.zeros(2)
    for _ in range(steps):
        kind = rng.integers(4)
        if kind == 0 or not points.count:
            n = int(rng.integers(1, 60))
            x, y = (center + rng.uniform(-1.0, 1.0, (n, 2))).T
            before = points.count
            new = added(points, x, y)
            assert points.count == before + new
        elif kind == 1:
            points.keep(rng.random(points.count) < 0.7)
        elif kind == 2:
            index = np.unique(rng.integers(0, points.count, 10))
            shift = rng.normal(0.0, 0.03, (2, index.size))
            points.move(index, points.data[X][index] + shift[0], points.data[Y][index] + shift[1])
        else:
            center = center + rng.uniform(-1.0, 1.0, 2)
            points.roll(*center.tolist())
            assert (np.abs(points.data[:2] - center[:, None]) <= 0.5 * SIZE_M).all()
    cells = np.floor(points.data[:2] / CELL_M).astype(int)
    assert np.unique(cells, axis=1).shape[1] == points.count  # at most one each
    at = center[:, None] + rng.uniform(-1.5, 1.5, (2, 40))
    index, away = points.nearest(at[0], at[1])
    for k in range(40):
        true = brute_force(points, *at[:, k])
        if true <= CELL_M:
            assert away[k] == pytest.approx(true)
        assert away[k] >= true - 1e-12
        assert (index[k] == NONE) == math.isinf(away[k])
    if points.count:
        index, away = points.nearest(points.data[X], points.data[Y])
        assert (index == np.arange(points.count)).all()


def test_of_several_points_in_a_cell_the_first_is_kept() -> None:
    points = MapPoints(CELL_M, SIZE_M)
    assert added(points, np.array([0.01, 0.02, 0.06]), np.array([0.01, 0.02, 0.01])) == 2
    assert added(points, np.array([0.03]), np.array([0.03])) == 0
    assert points.data[X].tolist() == [0.01, 0.06]
    assert points.data[HITS].tolist() == [1.0, 1.0]


def test_a_point_that_moves_into_another_s_cell_is_dropped() -> None:
    points = MapPoints(CELL_M, SIZE_M)
    added(points, np.array([0.01, 0.06, 0.16]), np.full(3, 0.01))
    assert points.move(np.array([0, 2]), np.array([0.07, 0.11]), np.full(2, 0.01))
    assert points.data[X].tolist() == [0.06, 0.11]
    assert points.nearest(np.array([0.07]), np.array([0.01]))[0].tolist() == [0]
    assert not points.move(np.array([1]), np.array([0.21]), np.array([0.01]))


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 80))
@settings(max_examples=40, deadline=None)
def test_the_field_holds_the_distances_to_the_points(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-2.5, 2.5, (2, n))
    center = rng.uniform(-1.0, 1.0, 2)
    low, high = tuple((center - 1.5).tolist()), tuple((center + 1.5).tolist())
    field = distance_field(x, y, low, high, CELL_M, 0.8)
    at = center[:, None] + rng.uniform(-1.4, 1.4, (2, 200))
    away = np.hypot(at[0][:, None] - x, at[1][:, None] - y).min(axis=1, initial=0.8)
    error = field.at(at[0], at[1]) - away
    assert np.abs(error).max() < 0.05  # at a point itself; interpolation rounds the kink off
    assert np.abs(error[away > 0.15]).max(initial=0.0) < 0.045
    assert field.at(np.array([50.0]), np.array([0.0])).tolist() == [0.8]


def test_a_point_outside_the_window_counts() -> None:
    field = distance_field(np.array([1.2]), np.array([0.0]), (-1.0, -1.0), (1.0, 1.0), CELL_M, 0.8)
    assert field.at(np.array([0.9]), np.array([0.0]))[0] == pytest.approx(0.3, abs=0.005)
