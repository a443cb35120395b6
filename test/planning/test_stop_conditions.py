# SPDX-License-Identifier: Apache-2.0
"""Which input stops a robot, at the limits of each condition."""

import math
from dataclasses import replace

import pytest

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Observation
from mfba_planner.planning.mode_transitions import Event
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.stop_conditions import reason_to_stop

PARAMS = PlannerParams()
STAMP_NS = 7 * 10**9
GOOD = Observation(
    stamp_ns=STAMP_NS, now_ns=STAMP_NS, pose=Pose2D(1.0, 2.0, 0.5), goal=(9.0, 2.0),
    ranges_m=(1.0, 2.0, math.inf), circles=(),
)  # fmt: skip


def event_of(*, sectors: bool = True, **changes: object) -> Event | None:
    found = reason_to_stop(replace(GOOD, **changes), PARAMS, sectors=sectors)  # type: ignore[arg-type]
    return found and found[0]


def test_valid_input_stops_nothing() -> None:
    assert event_of() is None
    assert event_of(stamp_ns=0, now_ns=0) is None
    assert event_of(ranges_m=(math.inf,) * 12) is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(5))
def test_any_number_that_is_not_finite_is_refused(bad: float, place: int) -> None:
    numbers = [1.0, 2.0, 0.5, 9.0, 2.0]
    numbers[place] = bad
    assert event_of(pose=Pose2D(*numbers[:3]), goal=tuple(numbers[3:])) is Event.INVALID


def test_finite_numbers_whose_sum_overflows_are_valid() -> None:
    assert event_of(pose=Pose2D(1e308, 1e308)) is None


@pytest.mark.parametrize(
    ("ranges", "sectors", "refused"),
    [
        ((1.0, 1.0), True, True), ((1.0, 1.0), False, False), ((), True, True),
        ((), False, False), ((1.0, math.nan, 1.0), True, True),
    ],
)  # fmt: skip
def test_fewer_than_three_sectors_and_nan_are_refused(
    ranges: tuple[float, ...], sectors: bool, refused: bool
) -> None:
    assert event_of(ranges_m=ranges, sectors=sectors) is (Event.INVALID if refused else None)


def test_a_negative_stamp_is_refused() -> None:
    assert event_of(stamp_ns=-1, now_ns=0) is Event.INVALID


@pytest.mark.parametrize(("late_ns", "stale"), [(-1, False), (1, True)])
def test_input_is_stale_after_its_timeout(late_ns: int, stale: bool) -> None:
    now_ns = STAMP_NS + round(PARAMS.input_timeout_s * 1e9) + late_ns
    assert event_of(now_ns=now_ns) is (Event.STALE if stale else None)


@pytest.mark.parametrize(("share", "there"), [(0.999, True), (1.001, False)])
def test_the_goal_is_reached_within_the_tolerance(share: float, there: bool) -> None:
    goal = (1.0 + share * PARAMS.goal_tolerance_m, 2.0)
    assert event_of(goal=goal) is (Event.AT_GOAL if there else None)


def test_the_first_condition_that_holds_is_named() -> None:
    """A refusal before age, age before a goal that is not given."""
    late_ns = 10**18
    assert event_of(refused="no", now_ns=late_ns, goal=None) is Event.INVALID
    assert event_of(now_ns=late_ns, goal=None) is Event.STALE
    assert event_of(goal=None) is Event.NO_GOAL
