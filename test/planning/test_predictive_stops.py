# SPDX-License-Identifier: Apache-2.0
"""The predictive planner stops: before contact with what stands, enclosed, on bad returns."""

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.core.planner_types import Circle, Mode, Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.base_planner import Move
from mfba_planner.planning.differential_drive import Speeds
from mfba_planner.planning.obstacles_at_rest import ObstaclesAtRest
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.predictive_planner import Predictive, preset
from mfba_planner.planning.stopping_path import stopping_path

PARAMS = preset(PlannerParams(speed_mps=0.8))
GOAL = (9.0, 8.0)
POSE = Pose2D(1.0, 2.0)


def planner(seed: int = 0) -> Predictive:
    return Predictive(PARAMS, SensorParams(), seed)


def observation(*circles: Circle, stamp_ns: int = 10**9) -> Observation:
    return Observation(
        stamp_ns=stamp_ns, now_ns=stamp_ns, pose=POSE, ranges_m=(), goal=GOAL, circles=circles
    )


def ring(away_m: float, speed_mps: float = 0.0, missing: int = 0) -> list[Circle]:
    """Twelve circles around POSE that move towards it, or some of them."""
    return [
        Circle(
            center_m=(POSE.x + away_m * math.cos(a), POSE.y + away_m * math.sin(a)),
            radius_m=0.6,
            velocity_mps=(-speed_mps * math.cos(a), -speed_mps * math.sin(a)),
        )
        for a in (k * math.pi / 6.0 for k in range(missing, 12))
    ]


@pytest.mark.parametrize("away_m", [0.6, 0.61, 0.75, 1.0])
def test_enclosed_by_obstacles_at_rest_it_is_blocked(away_m: float) -> None:
    decision = planner().plan(observation(*ring(away_m)))
    assert all(decision.vs)
    assert decision.mode is Mode.BLOCKED
    assert decision.velocity == (0.0, 0.0)
    assert decision.reason.startswith("enclosed by 12 obstacles at rest, the nearest ")


def test_a_ring_with_a_gap_or_of_moving_obstacles_does_not_block_it() -> None:
    for circles_around in (ring(1.2, missing=3), ring(0.9, speed_mps=0.2)):
        decision = planner().plan(observation(*circles_around))
        assert decision.mode is not Mode.BLOCKED
        assert math.hypot(*decision.velocity) > 0.1


def test_a_ring_that_opens_ends_the_block() -> None:
    one = planner()
    assert one.plan(observation(*ring(0.75))).mode is Mode.BLOCKED
    later = one.plan(observation(*ring(0.75, missing=5), stamp_ns=2 * 10**9))
    assert later.mode is not Mode.BLOCKED
    assert later.velocity != (0.0, 0.0)


def test_a_return_at_the_middle_of_the_robot_stops_it() -> None:
    """Every direction leads away from it: it would drive anywhere, through anything."""
    inside = Circle(center_m=(POSE.x + 0.05, POSE.y), radius_m=0.3)
    decision = planner().plan(observation(inside))
    assert (decision.mode, decision.velocity) == (Mode.BLOCKED, (0.0, 0.0))
    assert "0.25 m into the robot; check robot_radius_m" in decision.reason


standing = st.builds(
    lambda bearing, d, r: Circle(
        center_m=(POSE.x + (r + d) * math.cos(bearing), POSE.y + (r + d) * math.sin(bearing)),
        radius_m=r,
    ),
    st.floats(-math.pi, math.pi),
    st.floats(-0.05, 0.6),
    st.floats(0.3, 0.8),
)


moving = st.builds(
    lambda c, vx, vy: replace(c, velocity_mps=(vx, vy)),
    standing,
    st.floats(0.15, 1.0),
    st.floats(-1.0, 1.0),
)


@given(stands=st.lists(standing, min_size=1, max_size=14), moves=st.lists(moving, max_size=4))
@example(stands=ring(0.65, missing=2), moves=[])
@settings(max_examples=100)
def test_no_velocity_brings_contact_with_what_stands_before_the_robot_can_stop(
    stands: list[Circle], moves: list[Circle]
) -> None:
    """Even if the next decision, to stop, is half a tick late."""
    vx, vy = planner().plan(observation(*stands, *moves)).velocity
    for k in range(1, 7):
        t = 0.25 * k * PARAMS.tick_ns * 1e-9
        for c in stands:
            edge = distance((POSE.x + vx * t, POSE.y + vy * t), c.center_m) - c.radius_m
            before = distance(POSE.position, c.center_m) - c.radius_m
            assert edge >= min(0.0, before) - 1e-7


@given(st.floats(0.1, 0.8), st.floats(-math.pi, math.pi), st.floats(-0.4, 0.4))
def test_a_differential_base_in_the_open_keeps_off_by_its_stopping_path(
    v: float, yaw: float, aside_rad: float
) -> None:
    """Whatever is chosen: here full speed at what is as near as it may be to stop in time."""
    made = Predictive(replace(PARAMS, drive=Drive.DIFFERENTIAL), SensorParams(), 0)
    made._speeds = speeds = Speeds(v, 0.0)
    goal_m = distance(POSE.position, GOAL)
    still = stopping_path((0.0, 0.0), goal_m, yaw, speeds, made.params, made.tick_s)
    away_m = 0.5 + math.hypot(*still[-1].tolist()) + 0.01
    x, y = POSE.x + away_m * math.cos(yaw + aside_rad), POSE.y + away_m * math.sin(yaw + aside_rad)
    at_rest = ObstaclesAtRest(POSE.position, [Circle(center_m=(x, y), radius_m=0.5)])
    chosen = Move(velocity=(0.8 * math.cos(yaw), 0.8 * math.sin(yaw)), reason="ahead")
    velocity = made._kept_off(chosen, at_rest, Pose2D(POSE.x, POSE.y, yaw), goal_m).velocity
    path = stopping_path(velocity, goal_m, yaw, speeds, made.params, made.tick_s)
    nearest_m = min(distance((POSE.x + px, POSE.y + py), (x, y)) for px, py in path.tolist())
    assert nearest_m >= 0.5 - 1e-3


def sector_observation(tick: int, *ranges: float) -> Observation:
    stamp_ns = (10 + tick) * 10**8
    return Observation(
        stamp_ns=stamp_ns, now_ns=stamp_ns, pose=POSE, ranges_m=tuple(ranges), goal=GOAL
    )


def test_sectors_that_all_read_0_stop_it_and_name_the_remedy() -> None:
    decision = planner().plan(sector_observation(0, *[0.0] * 12))
    assert (decision.mode, decision.velocity) == (Mode.BLOCKED, (0.0, 0.0))
    assert decision.reason == (
        "enclosed by 12 obstacles at rest, the nearest 0.00 m off, 12 inside the robot's radius; "
        "check robot_radius_m, and range_min or the mask of the robot's own returns"
    )


@pytest.mark.parametrize("count", range(1, 8))
def test_in_contact_on_one_side_it_moves_away(count: int) -> None:
    """Up to seven sectors that read 0, around the direction of the goal."""
    first = 1 - count // 2
    touching = {(first + k) % 12 for k in range(count)}
    ranges = [0.0 if i in touching else math.inf for i in range(12)]
    vx, vy = planner().plan(sector_observation(0, *ranges)).velocity
    assert math.hypot(vx, vy) > 0.1
    for i in touching:
        middle = math.radians(15 + 30 * i)
        assert vx * math.cos(middle) + vy * math.sin(middle) <= 1e-9


def test_sectors_that_change_are_no_ring_at_rest() -> None:
    one = planner()
    decisions = [
        one.plan(sector_observation(tick, 0.6 - 0.02 * tick, *[0.6] * 11)) for tick in range(8)
    ]
    assert decisions[0].mode is Mode.BLOCKED
    assert decisions[4].mode is Mode.OBSTACLE_AVOIDANCE
    steady = planner()
    modes = {steady.plan(sector_observation(tick, *[0.6] * 12)).mode for tick in range(20)}
    assert modes == {Mode.BLOCKED}


@pytest.mark.parametrize("between", [[math.inf] * 12, [math.inf] * 11 + [0.7]])
def test_a_ring_that_appears_after_another_is_at_rest(between: list[float]) -> None:
    one = planner()
    rings = [[0.05] * 12, between, [0.2] * 12, [0.2] * 12]
    modes = [one.plan(sector_observation(t, *ranges)).mode for t, ranges in enumerate(rings)]
    assert modes[0] is modes[2] is modes[3] is Mode.BLOCKED
    assert modes[1] is not Mode.BLOCKED
