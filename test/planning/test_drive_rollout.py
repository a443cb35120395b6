# SPDX-License-Identifier: Apache-2.0
"""Turn delay and rollout of a differential drive, against the simulated base."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point, Pose2D, distance
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.core.robot_base import Base, Drive
from mfba_planner.planning.differential_drive import Speeds, apply_command, command
from mfba_planner.planning.drive_rollout import REACHED_M, DriveRollout
from mfba_planner.planning.turn_delay import TurnDelay

BASE = Base(drive=Drive.DIFFERENTIAL)
TICK_NS, TICK_S, SPEED = 100_000_000, 0.1, 0.8


def decision(pose: Pose2D, velocity: Point, goal: Point) -> Decision:
    return Decision(
        stamp_ns=0, mode=Mode.PATH_GENERATION, reason="", pose=pose, goal=goal, ranges_m=(),
        vs=(), vg=(), gap=0, waypoint=goal, velocity=velocity,
    )  # fmt: skip


def drive(base: Base, yaw: float, waypoint: Point, goal: Point, ticks: int) -> list[Pose2D]:
    """The simulated base, decided on every tick: to the waypoint, then to the goal."""
    pose, speeds, target = Pose2D(0.0, 0.0, yaw), Speeds(), waypoint
    poses = [pose]
    for _ in range(ticks):
        if distance(pose.position, target) < REACHED_M:
            target = goal
        dx, dy = target[0] - pose.x, target[1] - pose.y
        scale = SPEED / math.hypot(dx, dy)
        given_speeds = command(decision(pose, (dx * scale, dy * scale), goal), base, TICK_NS)
        pose, speeds = apply_command(pose, speeds, given_speeds, base, TICK_NS)
        poses.append(pose)
    return poses


@settings(max_examples=150, deadline=None)
@given(
    st.floats(-math.pi, math.pi), st.floats(0.3, 2.5), st.floats(-math.pi, math.pi), st.booleans()
)
def test_the_rollout_is_the_path_of_the_simulated_base(
    yaw: float, length_m: float, heading: float, reverse: bool
) -> None:
    base = replace(BASE, reverse=reverse)
    off = abs(math.remainder(yaw - heading, 2.0 * math.pi))
    if abs(off - 0.5 * math.pi) < 0.1 or off > 3.0:
        return  # it may turn to either side
    waypoint, goal = (length_m * math.cos(heading), length_m * math.sin(heading)), (9.0, 0.0)
    rollout = DriveRollout(base, yaw, Speeds(), SPEED, TICK_S)
    found = rollout.stretches(waypoint, 0.0, 1.0, goal, 3.0)
    found = [stretch for stretch in found if stretch.t_s < 3.0]
    poses = drive(base, yaw, waypoint, goal, 30)
    if math.dist(poses[-1].position, waypoint) < 2.0 * REACHED_M + 1.5 * SPEED:
        found = [stretch for stretch in found if stretch.t_s < 0.9]  # then it may turn around
    for stretch in found:
        real = poses[round(stretch.t_s / TICK_S)]
        reached = distance((stretch.x, stretch.y), waypoint) < 3.0 * REACHED_M
        # It may turn off one step of two ticks before the waypoint.
        allowed_m = 0.35 if reached or stretch.driven_s * SPEED > length_m else 0.04
        assert math.dist(real.position, (stretch.x, stretch.y)) < allowed_m


def test_the_stretches_of_a_rollout_join() -> None:
    rollout = DriveRollout(BASE, 1.0, Speeds(0.5, -1.0), SPEED, TICK_S)
    found = rollout.stretches((0.8, -0.6), 0.0, 1.0, (4.0, 1.0), 3.0)
    assert found[0][:4] == (0.0, 0.0, 0.0, 0.0)
    for one, following in zip(found, found[1:]):
        end = (one.x + one.vx * one.lasts_s, one.y + one.vy * one.lasts_s)
        assert (following.x, following.y) == pytest.approx(end)
        assert following.t_s == pytest.approx(one.t_s + one.lasts_s)
        length = math.hypot(one.vx, one.vy) * one.lasts_s
        assert following.driven_s == pytest.approx(one.driven_s + length / SPEED)
    assert found[-1].t_s + found[-1].lasts_s >= 3.0


def test_a_rollout_that_waits_turns_to_the_goal_but_does_not_move() -> None:
    rollout = DriveRollout(BASE, 1.5, Speeds(), SPEED, TICK_S)
    found = rollout.stretches((1e-6, 0.0), 1.4, 1e-6, (4.0, 0.0), 3.0)
    waiting = [stretch for stretch in found if stretch.t_s < 1.35]
    assert all(math.hypot(stretch.vx, stretch.vy) < 1e-5 for stretch in waiting)
    after = found[-1]
    assert (after.vx, after.vy) == pytest.approx((SPEED, 0.0), abs=0.02), "it has turned meanwhile"


@settings(max_examples=150, deadline=None)
@given(st.floats(-math.pi, math.pi))
def test_the_turn_delay_is_what_the_simulated_base_loses(heading: float) -> None:
    base = replace(BASE, reverse=False, max_accel_mps2=50.0)
    if abs(heading) > 3.0:
        return  # it may turn to either side
    goal = (100.0 * math.cos(heading), 100.0 * math.sin(heading))
    poses = drive(base, 0.0, goal, goal, 60)
    along = poses[-1].x * math.cos(heading) + poses[-1].y * math.sin(heading)
    lost_s = 6.0 - along / SPEED
    found = TurnDelay(base).towards(math.cos(heading), math.sin(heading))
    assert found == pytest.approx(lost_s, abs=0.25)


def test_the_turn_delay_by_hand() -> None:
    alpha, first = BASE.max_turn_accel_radps2, BASE.turn_first_rad
    small = 0.4
    took = 2.0 * math.sqrt(small / alpha)
    delay = TurnDelay(BASE)
    assert delay.towards(math.cos(small), math.sin(small)) == pytest.approx(
        took * 0.5 * small / first
    )
    quarter = 0.5 * math.pi - 1e-9
    took, last = 2.0 * math.sqrt(quarter / alpha), math.sqrt(2.0 * first / alpha)
    expected = pytest.approx(took - last + last / 3.0)
    assert delay.towards(math.cos(quarter), math.sin(quarter)) == expected
    assert delay.towards(math.cos(quarter), -math.sin(quarter)) == expected
    assert delay.between(1.0, 0.0, math.cos(quarter), math.sin(quarter)) == expected
    assert delay.towards(1.0, 0.0) == delay.between(0.3, 0.3, 2.0, 2.0) == 0.0


def test_a_base_that_reverses_turns_by_a_quarter_at_most() -> None:
    forward = TurnDelay(replace(BASE, reverse=False))
    both = TurnDelay(BASE)
    assert both.towards(-1.0, 1e-9) == pytest.approx(0.0, abs=1e-6)
    assert forward.towards(-1.0, 1e-9) > 1.5
    assert both.between(1.0, 0.0, -1.0, 0.0) == 0.0


@given(st.floats(0.1, 1.5), st.floats(0.1, 2.0))
def test_turning_already_shortens_the_delay(error: float, rate: float) -> None:
    ux, uy = math.cos(error), math.sin(error)
    at_rest = TurnDelay(BASE).towards(ux, uy)
    assert TurnDelay(BASE, 0.0, -rate).towards(ux, uy) > at_rest
    if rate * rate / (2.0 * BASE.max_turn_accel_radps2) < error:
        assert TurnDelay(BASE, 0.0, rate).towards(ux, uy) < at_rest


@given(
    st.lists(st.floats(-3.1, 3.1), min_size=1, max_size=8),
    st.floats(-3.0, 3.0),
    st.floats(-2.5, 2.5),
    st.booleans(),
)
def test_the_delays_of_many_directions_are_those_of_each(
    headings: list[float], yaw: float, rate: float, reverse: bool
) -> None:
    """Formulas of their own: for arrays, and for the numbers of the hot path in the open."""
    delay = TurnDelay(replace(BASE, reverse=reverse), yaw, rate)
    for heading in headings:  # else it may turn to either side
        off = abs(math.remainder(heading - yaw, 2.0 * math.pi))
        assume(min(abs(off - side) for side in (0.0, 0.5 * math.pi, math.pi)) > 1e-6)
    ux, uy = np.cos(headings), np.sin(headings)
    each = [delay.towards(x, y) for x, y in zip(ux.tolist(), uy.tolist())]
    assert delay.towards_all(ux, uy) == pytest.approx(each, abs=1e-9)
