# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mfba_planner.core.planner_types import Bits
from mfba_planner.planning.gap_vector import GapHeading, gap_heading, gap_vector, nearest_free_gap

BITS = st.lists(st.integers(0, 1), min_size=3, max_size=40).map(tuple)
ANGLES = st.floats(-10.0, 10.0)


def bits(text: str) -> Bits:
    return tuple(map(int, text))


@pytest.mark.parametrize(("a", "b", "gap"), [(0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)])
def test_table_1(a: int, b: int, gap: int) -> None:
    assert gap_vector((a, b, 0))[0] == gap
    assert gap_vector((0, a, b))[1] == gap
    assert gap_vector((b, 0, a))[2] == gap, "the last gap lies between the last sector and S1"


def test_the_example_of_fig_5() -> None:
    assert gap_vector(bits("110000111000")) == bits("110001111001")


def test_an_empty_and_a_full_ring() -> None:
    assert gap_vector(bits("000000000000")) == bits("000000000000")
    assert gap_vector(bits("111111111111")) == bits("111111111111")


@given(BITS)
def test_a_gap_is_free_between_two_free_sectors(vs: Bits) -> None:
    vg = gap_vector(vs)
    assert len(vg) == len(vs)  # eq. 12
    for i, closed in enumerate(vg):
        assert bool(closed) == (vs[i] == 1 or vs[(i + 1) % len(vs)] == 1)


@given(BITS, st.integers(0, 40))
def test_the_gaps_turn_with_the_sectors(vs: Bits, turns: int) -> None:
    k = turns % len(vs)
    assert gap_vector(vs[k:] + vs[:k]) == gap_vector(vs)[k:] + gap_vector(vs)[:k]


@pytest.mark.parametrize(
    ("gap", "count", "degrees"),
    [
        (1, 12, 30),
        (3, 12, 90),
        (6, 12, 180),
        (7, 12, -150),
        (12, 12, 0),
        (1, 3, 120),
        (2, 3, -120),
    ],
)
def test_a_gap_heads_along_the_bound_of_its_sectors(gap: int, count: int, degrees: int) -> None:
    assert math.degrees(gap_heading(gap, count)) == pytest.approx(degrees, abs=1e-9)


@pytest.mark.parametrize(
    ("vg", "goal_deg", "gap"),
    [
        ("000000000000", 31.0, 1),
        ("000000000000", 44.9, 1),
        ("000000000000", 45.1, 2),
        ("000000000000", -1.0, 12),
        ("000000000000", 359.0, 12),
        ("000000000000", -179.0, 6),
        ("110001111001", 45.0, 3),  # Fig. 5 with a goal up and to the right
        ("110001111001", 0.0, 11),
        ("110001111001", 20.0, 11),  # 50 degrees to gap 11, 70 to gap 3
        ("111111111110", 180.0, 12),
        ("011111111111", -150.0, 1),
    ],
)
def test_the_nearest_free_gap(vg: str, goal_deg: float, gap: int) -> None:
    assert nearest_free_gap(bits(vg), math.radians(goal_deg)) == gap


@pytest.mark.parametrize(
    ("vg", "goal_deg", "lower"),
    [
        ("000000000000", 45.0, 1),
        ("000000000000", 15.0, 1),  # not gap 12 at 0 degrees
        ("000000000000", 345.0, 11),
        ("000000000000", 195.0, 6),
        ("110000000001", 30.0, 3),  # gaps 3 and 11, 60 degrees to either side
        ("000001000000", 180.0, 5),
        ("111011111011", 210.0, 4),
        ("111111111001", 315.0, 10),
    ],
)
def test_the_lower_of_two_equally_near_gaps(vg: str, goal_deg: float, lower: int) -> None:
    assert nearest_free_gap(bits(vg), math.radians(goal_deg)) == lower


def turn(gap: int, count: int, goal: float) -> float:
    """Angle between two unit vectors."""
    heading = 2.0 * math.pi * gap / count
    dot = math.cos(heading) * math.cos(goal) + math.sin(heading) * math.sin(goal)
    return math.acos(max(-1.0, min(1.0, dot)))


@given(BITS, ANGLES)
def test_nearest_free_gap_against_brute_force(vg: Bits, goal: float) -> None:
    n = len(vg)
    free = [gap for gap, closed in enumerate(vg, start=1) if not closed]
    chosen = nearest_free_gap(vg, goal)
    if not free:
        assert chosen is None
        return
    assert chosen in free
    turns = sorted(turn(gap, n, goal) for gap in free)
    assert turn(chosen, n, goal) == pytest.approx(turns[0], abs=1e-6)


@given(st.integers(3, 60), st.data())
def test_rounding_never_decides_between_two_equal_gaps(n: int, data: st.DataObject) -> None:
    low = data.draw(st.integers(1, n - 1))
    high = data.draw(st.integers(low + 1, n))
    assume(2 * (high - low) != n)  # opposite each other, both bisectors are equally near
    vg = tuple(0 if gap in (low, high) else 1 for gap in range(1, n + 1))
    middle = math.pi * (low + high) / n + (math.pi if 2 * (high - low) > n else 0.0)
    assert nearest_free_gap(vg, middle) == low


def test_every_gap_closed() -> None:
    assert nearest_free_gap(bits("111111111111"), 0.3) is None


def test_a_gap_may_head_along_the_middle_of_its_first_sector() -> None:
    assert gap_heading(1, 12, GapHeading.MIDDLE) == pytest.approx(math.radians(15.0))
    assert gap_heading(12, 12, GapHeading.MIDDLE) == pytest.approx(math.radians(-15.0))
    vg = (1, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 0)
    # boundaries 60, 90 and 0 degrees; middles 45, 75 and -15
    assert nearest_free_gap(vg, math.radians(70.0)) == 2
    assert nearest_free_gap(vg, math.radians(70.0), GapHeading.MIDDLE) == 3
