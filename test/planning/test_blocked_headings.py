# SPDX-License-Identifier: Apache-2.0
"""Headings in which the robot stood still: blocked after a while, near there, for a while."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point
from mfba_planner.planning.blocked_headings import (
    HELD_NS,
    NEAR_M,
    PLACE_M,
    PLACE_NS,
    STANDS_NS,
    WIDE_RAD,
    BlockedHeadings,
    PlaceCheck,
)

HEADINGS = np.linspace(-math.pi, math.pi, 73)[1:]
SECOND_NS = 1_000_000_000
HERE = (1.0, -2.0)


def stood(heading_rad: float, place: Point = HERE) -> BlockedHeadings:
    """Blocked at STANDS_NS after second 5."""
    made = BlockedHeadings()
    assert not made.stands(5 * SECOND_NS, place, heading_rad)
    assert not made.stands(5 * SECOND_NS + STANDS_NS - 1, place, heading_rad)
    assert made.stands(5 * SECOND_NS + STANDS_NS, place, heading_rad)
    return made


NOW_NS = 5 * SECOND_NS + STANDS_NS


@given(st.floats(-math.pi, math.pi))
def test_headings_near_the_blocked_one_are_closed_and_no_others(heading_rad: float) -> None:
    found = stood(heading_rad).open(NOW_NS, HERE, HEADINGS)
    assert found is not None
    for heading, is_open in zip(HEADINGS.tolist(), found.tolist()):
        off = abs(math.remainder(heading - heading_rad, 2.0 * math.pi))
        if abs(off - WIDE_RAD) > 1e-9:
            assert is_open == (off > WIDE_RAD)


@pytest.mark.parametrize("after_ns", [-1, HELD_NS])
def test_it_is_forgotten_after_a_while_and_when_the_clock_goes_back(after_ns: int) -> None:
    assert stood(0.0).open(NOW_NS + HELD_NS - 1, HERE, HEADINGS) is not None
    assert stood(0.0).open(NOW_NS + after_ns, HERE, HEADINGS) is None


@pytest.mark.parametrize(("away_m", "counts"), [(0.99 * NEAR_M, True), (1.01 * NEAR_M, False)])
def test_it_counts_near_that_place_only(away_m: float, counts: bool) -> None:
    found = stood(0.0).open(NOW_NS, (HERE[0], HERE[1] - away_m), HEADINGS)
    assert (found is not None) == counts


def test_a_decision_to_drive_begins_the_wait_anew() -> None:
    made = BlockedHeadings()
    made.stands(0, HERE, 0.0)
    made.drives()
    assert not made.stands(STANDS_NS, HERE, 0.0)
    assert made.stands(2 * STANDS_NS, HERE, 0.0)
    assert not made.stands(2 * STANDS_NS + 1, HERE, 0.0), "the next heading waits as long"


def test_two_headings_are_both_closed() -> None:
    made = stood(0.0)
    made.stands(NOW_NS, HERE, math.pi)
    assert made.stands(NOW_NS + STANDS_NS, HERE, math.pi)
    found = made.open(NOW_NS + STANDS_NS, HERE, np.array([0.0, math.pi, 0.5 * math.pi]))
    assert found is not None
    assert found.tolist() == [False, False, True]


def arrived_from(start: Point) -> PlaceCheck:
    """At HERE since second 2, after start."""
    check = PlaceCheck()
    assert check.stays(SECOND_NS, start) is None
    assert check.stays(2 * SECOND_NS, HERE) is None
    return check


@given(st.floats(-math.pi, math.pi), st.floats(1.1 * PLACE_M, 3.0), st.floats(0.0, 0.9 * PLACE_M))
def test_a_place_that_is_not_left_gives_the_heading_in_which_the_robot_came(
    heading_rad: float, came_m: float, aside_m: float
) -> None:
    """Away from where the robot came from, wherever it turns meanwhile."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    check = arrived_from((HERE[0] - came_m * c, HERE[1] - came_m * s))
    then_ns = 2 * SECOND_NS + PLACE_NS
    near = (HERE[0] + aside_m * s, HERE[1] - aside_m * c)
    assert check.stays(then_ns - 1, near) is None
    found = check.stays(then_ns, HERE)
    assert found is not None
    assert math.remainder(found - heading_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert check.stays(then_ns + PLACE_NS - 1, HERE) is None, "the time begins anew"
    assert check.stays(then_ns + PLACE_NS, HERE) is not None


def test_a_robot_that_drives_is_waited_for_anew() -> None:
    check = arrived_from((0.0, 0.0))
    position = HERE
    for tick in range(200):
        position = (position[0] + 0.01 * PLACE_M, position[1])
        stamp_ns = 2 * SECOND_NS + tick * PLACE_NS // 150
        assert check.stays(stamp_ns, position) is None


@pytest.mark.parametrize("event", ["reset", "clock", "first place"])
def test_nothing_is_ahead_without_a_place_before(event: str) -> None:
    check = arrived_from((0.0, 0.0)) if event != "first place" else PlaceCheck()
    if event == "reset":
        check.reset()
    begin_ns = 1 if event == "clock" else 3 * SECOND_NS
    assert check.stays(begin_ns, HERE) is None
    found = check.stays(begin_ns + PLACE_NS, HERE)
    assert (found is None) == (event != "clock")
