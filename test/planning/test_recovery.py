# SPDX-License-Identifier: Apache-2.0
"""Recovery of a blocked robot: phase table, bounded time, room; off by default; speed limit."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.core.option_specs import override
from mfba_planner.core.planner_types import Decision, Mode, Observation
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.recovery import (
    Phase,
    Recovery,
    RecoveryParams,
    advance,
    longest_s,
    most_room,
)
from mfba_planner.planning.speed_limit import SpeedLimitParams, allowed_speed_share
from mfba_planner.planning.supervised_planner import SupervisedPlanner

S = 1_000_000_000
INF = math.inf
PARAMS = RecoveryParams(enabled=True, wait_s=2.0, back_off_s=1.0, attempts=3)
OPEN_GAP = Recovery(phase=Phase.FREE, since_ns=10 * S, free_ns=12 * S, attempt=2)


def state_in(phase: Phase, attempt: int = 1) -> Recovery:
    return Recovery(phase=phase, since_ns=10 * S, free_ns=5 * S, attempt=attempt)


@pytest.mark.parametrize(
    ("state", "blocked", "now_s", "phase", "attempt"),
    [
        (Recovery(), False, 9, Phase.FREE, 0),
        (Recovery(), True, 9, Phase.WAIT, 0),
        (state_in(Phase.WAIT), True, 11, Phase.WAIT, 1),
        (state_in(Phase.WAIT), True, 12, Phase.BACK_OFF, 2),
        (state_in(Phase.WAIT), False, 11, Phase.FREE, 1),
        (state_in(Phase.WAIT), False, 12, Phase.FREE, 1),
        (state_in(Phase.WAIT, 3), True, 12, Phase.GIVEN_UP, 3),
        (state_in(Phase.BACK_OFF), True, 10.5, Phase.BACK_OFF, 1),
        (state_in(Phase.BACK_OFF), False, 10.5, Phase.BACK_OFF, 1),
        (state_in(Phase.BACK_OFF), True, 11, Phase.REPLAN, 1),
        (state_in(Phase.BACK_OFF), False, 11, Phase.REPLAN, 1),
        (state_in(Phase.REPLAN), True, 11, Phase.WAIT, 1),
        (state_in(Phase.REPLAN), False, 11, Phase.FREE, 1),
        (state_in(Phase.GIVEN_UP, 3), True, 99, Phase.GIVEN_UP, 3),
        (state_in(Phase.GIVEN_UP, 3), False, 99, Phase.GIVEN_UP, 3),
        (OPEN_GAP, False, 13.9, Phase.FREE, 2),
        (OPEN_GAP, False, 14, Phase.FREE, 0),
        (OPEN_GAP, True, 13.9, Phase.BACK_OFF, 3),
        (replace(OPEN_GAP, since_ns=12 * S), True, 13.9, Phase.WAIT, 2),
        (OPEN_GAP, True, 14, Phase.WAIT, 0),
    ],
)
def test_phases_follow_each_other(
    state: Recovery, blocked: bool, now_s: float, phase: Phase, attempt: int
) -> None:
    after = advance(state, blocked, round(now_s * S), PARAMS)
    assert (after.phase, after.attempt) == (phase, attempt)


def test_a_flickering_gap_does_not_restart_the_wait() -> None:
    state = Recovery()
    for tick in range(4):
        state = advance(state, tick % 2 == 0, (10 + tick) * S // 2, PARAMS)
    assert state.phase is Phase.FREE
    assert advance(state, True, 69 * S // 10, PARAMS).since_ns == 5 * S
    assert advance(state, True, 7 * S, PARAMS).phase is Phase.BACK_OFF


@given(
    wait_s=st.floats(0.0, 5.0),
    back_off_s=st.floats(0.0, 3.0),
    attempts=st.integers(0, 5),
    tick_ms=st.integers(20, 700),
    gaps=st.lists(st.booleans(), min_size=1, max_size=40),
)
def test_it_gives_up_in_bounded_time(
    wait_s: float, back_off_s: float, attempts: int, tick_ms: int, gaps: list[bool]
) -> None:
    """For any flickering gaps that stay open for less than wait_s."""
    params = RecoveryParams(enabled=True, wait_s=wait_s, back_off_s=back_off_s, attempts=attempts)
    tick_ns = tick_ms * 1_000_000
    state, now_ns, open_ns, start_ns = Recovery(), S, 0, S
    limit_ns = start_ns + longest_s(params, tick_ms * 1e-3) * S
    k = 0
    while state.phase is not Phase.GIVEN_UP:
        gap = gaps[k % len(gaps)] and open_ns + 2 * tick_ns < wait_s * S and k > 0
        open_ns = open_ns + tick_ns if gap else 0
        state = advance(state, not gap, now_ns, params)
        assert now_ns <= limit_ns + 1
        now_ns += tick_ns
        k += 1
    assert state.attempt == attempts


def test_most_room_is_the_free_side_and_of_equals_the_preferred_heading() -> None:
    everywhere = (0.5,) * 12
    heading, room = most_room(everywhere, math.radians(200.0))
    assert (round(math.degrees(heading)), room) == (-165, 0.5)
    behind = tuple(INF if 4 <= i <= 9 else 0.2 for i in range(12))
    heading, room = most_room(behind, math.pi)
    assert round(abs(math.degrees(heading))) == 165
    assert room > 0.5


@given(
    st.lists(
        st.tuples(st.floats(-1.3, 1.3), st.floats(-1.3, 1.3), st.floats(0.1, 0.8)),
        min_size=1,
        max_size=6,
    )
)
def test_a_move_of_half_the_room_touches_no_obstacle_at_rest(
    circles: list[tuple[float, float, float]],
) -> None:
    origin = (0.0, 0.0)
    known = [((x, y), r) for x, y, r in circles if math.hypot(x, y) > r]
    ranges = sense_circles(origin, known, SensorParams(sensing_range_m=3.0))
    heading, room = most_room(ranges, 0.0)
    step = min(0.5 * room, 1.0)
    moved = (step * math.cos(heading), step * math.sin(heading))
    for center, r in known:
        assert distance(moved, center) >= r - 1e-6


BLOCKED = (0.5,) * 11 + (0.6,)


def observation(tick: int, ranges: tuple[float, ...] = BLOCKED, x: float = 0.0) -> Observation:
    stamp = (tick + 1) * S
    return Observation(
        stamp_ns=stamp, pose=Pose2D(x, 0.0), ranges_m=ranges, goal=(9.0, 0.0), now_ns=stamp
    )


def test_by_default_decisions_are_unchanged() -> None:
    params = PlannerParams()
    bare, supervised = Algorithm1(params, 3), SupervisedPlanner(Algorithm1(params, 3))
    for tick in range(20):
        ranges = BLOCKED if tick % 3 else (0.3,) + (INF,) * 11
        assert supervised.plan(observation(tick, ranges, x=0.1 * tick)) == bare.plan(
            observation(tick, ranges, x=0.1 * tick)
        )
    assert supervised.phase is Phase.FREE


def drive(supervised: SupervisedPlanner, ticks: int) -> list[Decision]:
    return [supervised.plan(observation(tick)) for tick in range(ticks)]


def test_blocked_it_waits_backs_off_replans_and_gives_up_until_reset() -> None:
    params = override(PlannerParams(), {"recovery.enabled": True, "recovery.attempts": 1})
    supervised = make_planner(params, seed=1)
    decisions = drive(supervised, 9)
    reasons = [decision.reason for decision in decisions]
    assert reasons[0].endswith("every gap is closed; waiting for 0.0 s")
    assert reasons[2] == "backing off, attempt 1 of 1"
    assert reasons[3].startswith("replanning, attempt 1 of 1: sectors 1+2+")
    assert reasons[-1] == "gave up after 1 attempts; send a goal to go on"
    assert {decision.mode for decision in decisions} == {Mode.BLOCKED}
    moving = [decision.velocity != (0.0, 0.0) for decision in decisions]
    assert moving == [False, False, True, *([False] * 6)]
    assert decisions[2].waypoint[0] > 0.0, "to sector 12, with the most room"
    free = (INF,) * 12
    assert supervised.plan(observation(9, free)).mode is Mode.BLOCKED
    supervised.reset()
    assert supervised.plan(observation(10, free)).mode is Mode.PATH_GENERATION


def test_an_odometry_jump_restarts_the_recovery() -> None:
    params = override(PlannerParams(), {"recovery.enabled": True, "recovery.attempts": 1})
    supervised = make_planner(params, seed=1)
    assert drive(supervised, 9)[-1].reason.startswith("gave up")
    moved = supervised.plan(observation(9, x=5.0))
    assert moved.reason.startswith("carried off 5 m in 1 s")
    assert moved.reason.endswith("every gap is closed; waiting for 0.0 s")
    assert supervised.phase is Phase.WAIT


def test_refused_input_stops_the_robot_in_any_phase() -> None:
    params = override(PlannerParams(), {"recovery.enabled": True})
    supervised = make_planner(params, seed=1)
    drive(supervised, 2)
    blind = replace(observation(2), refused="sector 1 holds nan", ranges_m=())
    assert supervised.plan(blind).velocity == (0.0, 0.0)


@pytest.mark.parametrize(
    ("nearest", "share"), [(INF, 1.0), (0.8, 1.0), (0.4, 0.5), (0.1, 0.2), (0.0, 0.2)]
)
def test_the_speed_falls_with_the_clearance(nearest: float, share: float) -> None:
    speed_limit = SpeedLimitParams(slow_within_m=0.8, least_share=0.2)
    ranges = (INF, nearest, INF)
    assert allowed_speed_share(ranges, speed_limit) == pytest.approx(share)
    assert allowed_speed_share(ranges, SpeedLimitParams()) == 1.0
    params = PlannerParams(speed_limit=speed_limit)
    one_sided = (INF,) * 6 + (nearest,) + (INF,) * 5
    full = make_planner(PlannerParams()).plan(observation(0, one_sided))
    slow = make_planner(params).plan(observation(0, one_sided))
    assert slow.waypoint == pytest.approx([share * w for w in full.waypoint])
    assert math.hypot(*slow.velocity) == pytest.approx(share * math.hypot(*full.velocity))
    if share < 1.0:
        assert slow.reason.endswith(f"; {100 * share:.0f} % speed so near")


def test_options_out_of_range_are_refused() -> None:
    for options in ({"wait_s": -1.0}, {"attempts": -1}, {"back_off_mps": math.nan}):
        with pytest.raises(ConfigError):
            RecoveryParams(**options)  # type: ignore[arg-type]
    with pytest.raises(ConfigError):
        SpeedLimitParams(least_share=1.5)
