# SPDX-License-Identifier: Apache-2.0
"""Where motion was: remembered around the place, and nowhere else in the window."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.perception.moving_returns import MovingReturns

SIZE_M = 12.0
MILLIMETRES = st.integers(-6000, 6000)
MIDDLES = MILLIMETRES.map(lambda n: 1e-3 * n)
PLACES = MILLIMETRES.map(lambda n: 1e-3 * n + 5e-4)  # never on an edge of a cell


def asked(motion: MovingReturns, x: float, y: float, since_s: float = 0.0) -> bool:
    return bool(motion.recent(np.array([x]), np.array([y]), since_s)[0])


@given(st.tuples(MIDDLES, MIDDLES), st.tuples(PLACES, PLACES), st.tuples(PLACES, PLACES))
def test_motion_is_remembered_around_its_place_only(
    middle: tuple[float, float], moved: tuple[float, float], other: tuple[float, float]
) -> None:
    """In a window of SIZE_M anywhere: two places of it never share a cell."""
    motion = MovingReturns(SIZE_M)
    (mx, my), (x, y), (ox, oy) = middle, moved, other
    motion.remember(np.array([mx + x]), np.array([my + y]), 1.0)
    assert asked(motion, mx + x, my + y)
    for dx, dy in ((0.1, 0.0), (-0.1, 0.1), (0.0, -0.1)):
        assert asked(motion, mx + x + dx, my + y + dy)
    if max(abs(x - ox), abs(y - oy)) > 0.2 + 1e-9:
        assert not asked(motion, mx + ox, my + oy)


def test_older_motion_is_not_recent_and_can_be_forgotten() -> None:
    motion = MovingReturns(SIZE_M)
    motion.remember(np.array([1.0]), np.array([2.0]), 3.0)
    assert asked(motion, 1.0, 2.0, since_s=2.9)
    assert not asked(motion, 1.0, 2.0, since_s=3.0)
    motion.clear()
    assert not asked(motion, 1.0, 2.0, since_s=-1e9)


@pytest.mark.parametrize(
    ("x", "inside"), [(0.0, True), (0.39, True), (0.41, False), (-0.39, True), (-0.41, False)]
)
def test_returns_close_to_a_moving_circle_are_its_own(x: float, inside: bool) -> None:
    moving = np.array([[5.0, 5.0, 0.0, 0.0, 0.1], [0.0, 1.0, 0.4, 0.0, 0.3]])
    found = MovingReturns(SIZE_M).near_any(np.array([x, 9.0]), np.array([1.0, 9.0]), moving)
    assert found.tolist() == [inside, False]
    none = MovingReturns(SIZE_M).near_any(np.array([x]), np.array([1.0]), moving[:0])
    assert none.tolist() == [False]
