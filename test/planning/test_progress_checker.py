# SPDX-License-Identifier: Apache-2.0
"""Progress of a trip: nearer or on new ground; pauses; limits; memory; options."""

import math
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.planning.progress_checker import ProgressChecker, ProgressParams

TICK_NS = 100_000_000
GOAL = (50.0, 0.0)
PARAMS = ProgressParams(time_allowance_s=5.0, detour_allowance_s=20.0)


def decision(tick: int, position: Point, goal: Point | None = GOAL) -> Decision:
    return Decision(
        stamp_ns=(tick + 1) * TICK_NS, mode=Mode.OBSTACLE_AVOIDANCE, reason="", goal=goal,
        pose=Pose2D(*position), ranges_m=(), vs=(), vg=(), gap=0, waypoint=position,
        velocity=(0.5, 0.0),
    )  # fmt: skip


def first_reason(
    positions: Iterable[Point], params: ProgressParams = PARAMS
) -> tuple[float, str] | None:
    """Time in s and text of the first reason."""
    checker = ProgressChecker()
    for tick, position in enumerate(positions):
        reason = checker.check(decision(tick, position), params)
        if reason:
            return tick * 0.1, reason
    return None


def to_and_fro(tick: int) -> Point:
    """Along 3 m of a wall at 0.5 m/s."""
    phase = (0.05 * tick) % 6.0
    return (0.9, phase if phase < 3.0 else 6.0 - phase)


def test_to_and_fro_is_no_progress_once_its_ground_is_known() -> None:
    found = first_reason(map(to_and_fro, range(1000)))
    assert found is not None
    when_s, reason = found
    assert 5.0 + 5.0 <= when_s <= 5.0 + 6.5, "3 m at 0.5 m/s is new ground for 6 s"
    assert reason == (
        f"no progress: 0.00 m nearer to the goal in {when_s:.0f} s of driving, "
        "no new ground in 5 s"
    )


def test_a_robot_that_stays_in_its_place_makes_no_progress() -> None:
    found = first_reason((0.3, 0.3) for _ in range(100))
    assert found is not None
    assert found[0] == pytest.approx(5.0)


@pytest.mark.parametrize("speed_mps", [0.021, 0.5, 2.0])
def test_nearer_to_the_goal_is_progress_at_any_speed(speed_mps: float) -> None:
    assert first_reason((0.1 * speed_mps * k, 0.0) for k in range(240)) is None


def test_a_detour_is_progress_for_a_limited_time() -> None:
    away = [(-0.05 * k, 0.0) for k in range(1000)]
    found = first_reason(away)
    assert found is not None
    assert 20.0 + 4.0 <= found[0] <= 20.0 + 5.1
    assert found[1] == f"no progress: 0.00 m nearer to the goal in {found[0]:.0f} s of driving"
    there_and_past = away[:150] + [(away[149][0] + 0.1 * k, 3.0) for k in range(400)]
    assert first_reason(there_and_past) is None


def test_only_driving_time_counts() -> None:
    """Groups of nine decisions, 0.8 s, with long pauses in between."""
    checker = ProgressChecker()
    for group in range(10):
        for k in range(9):
            if checker.check(decision(100_000 * group + k, (0.3, 0.3)), PARAMS):
                assert group == 6, "5 s are over in the seventh group"
                return
        checker.pause()
    pytest.fail("no reason in 8 s of driving")


def test_a_restart_allows_the_time_again_and_counts_until_it_is_nearer() -> None:
    checker, tick = ProgressChecker(), 0
    for tries in range(4):
        assert checker.tries == tries
        start = tick
        while not checker.check(decision(tick, (0.3, 0.3)), PARAMS):
            tick += 1
        assert (tick - start) * 0.1 == pytest.approx(5.0, abs=0.2)
        checker.restart()
    assert not checker.check(decision(tick, (0.5, 0.3)), PARAMS)
    assert checker.tries == 0


@given(st.lists(st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)), min_size=1, max_size=30))
def test_any_trip_that_repeats_itself_ends_in_bounded_time(places: list[Point]) -> None:
    ticks = round(10 * (PARAMS.detour_allowance_s + PARAMS.time_allowance_s)) + 2 * len(places)
    assert first_reason(places[k % len(places)] for k in range(ticks + 2)) is not None


def test_its_memory_is_limited() -> None:
    """10^5 ticks towards the goal, and as many away from it."""
    for sign in (1.0, -1.0):
        checker = ProgressChecker()
        for tick in range(100_000):
            checker.check(decision(tick, (0.2 * sign * tick, 0.0), (1e6, 0.0)), PARAMS)
        assert len(checker._squares) <= 1 + PARAMS.detour_allowance_s * 2.0 / PARAMS.cell_m


def test_0_is_no_limit_and_without_a_goal_there_is_none() -> None:
    off = ProgressParams(time_allowance_s=0.0)
    assert first_reason(((0.0, 0.0) for _ in range(1000)), off) is None
    checker = ProgressChecker()
    for tick in range(1000):
        assert not checker.check(decision(tick, (0.0, 0.0), goal=None), PARAMS)


def test_a_pose_of_any_size_is_no_fault() -> None:
    assert first_reason([(1e308, -1e308), (-1e308, 1e300)]) is None


@pytest.mark.parametrize(
    "options", [{"nearer_m": 0.0}, {"cell_m": -1.0}, {"time_allowance_s": math.nan}]
)
def test_options_out_of_range_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        ProgressParams(**options)
