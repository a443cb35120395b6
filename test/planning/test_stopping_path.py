# SPDX-License-Identifier: Apache-2.0
"""The stopping path of a differential base: against the simulated base, and what it keeps off."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import NANO
from mfba_planner.core.robot_base import Base, Drive
from mfba_planner.planning.differential_drive import Speeds, apply_command, heading_law
from mfba_planner.planning.obstacles_at_rest import STOPPING_TICKS
from mfba_planner.planning.stopping_path import SHARES, clear_velocity, stopping_path

BASE = Base(drive=Drive.DIFFERENTIAL)
TICK_S, GOAL_M = 0.1, 9.0
velocities = st.tuples(st.floats(0.05, 1.0), st.floats(-3.1, 3.1)).map(
    lambda polar: (polar[0] * math.cos(polar[1]), polar[0] * math.sin(polar[1]))
)


@given(velocities, st.floats(-3.1, 3.1), st.floats(0.0, 1.0), st.floats(-2.0, 2.0))
def test_it_ends_where_the_simulated_base_stands(
    velocity: tuple[float, float], yaw: float, v: float, omega: float
) -> None:
    path = stopping_path(velocity, GOAL_M, yaw, Speeds(v, omega), BASE, TICK_S)
    wanted = heading_law(velocity, GOAL_M, yaw, BASE, TICK_S)
    held_ns = round(0.02 * math.ceil(STOPPING_TICKS * TICK_S / 0.02) / NANO)
    pose, speeds = apply_command(Pose2D(0.0, 0.0, yaw), Speeds(v, omega), wanted, BASE, held_ns)
    while speeds.v:
        pose, speeds = apply_command(pose, speeds, Speeds(), BASE, 20_000_000)
    assert path[-1] == pytest.approx(pose.position, abs=1e-9)


@given(
    velocities,
    st.floats(-3.1, 3.1),
    st.floats(0.0, 0.6),
    st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), min_size=1, max_size=5),
    st.booleans(),
)
def test_nothing_comes_nearer_than_allowed_unless_the_base_cannot_stop(
    velocity: tuple[float, float],
    yaw: float,
    v: float,
    points: list[tuple[float, float]],
    reverse: bool,
) -> None:
    base, speeds = replace(BASE, reverse=reverse), Speeds(v, 0.0)
    standing = np.array([(x, y, 0.3) for x, y in points])
    chosen, share = clear_velocity(velocity, GOAL_M, yaw, speeds, base, TICK_S, standing)
    assume(share > 0.0)
    assert math.hypot(*chosen) == pytest.approx(share * math.hypot(*velocity))
    path = stopping_path(chosen, GOAL_M, yaw, speeds, base, TICK_S)
    for x, y, r in standing.tolist():
        away = np.hypot(path[:, 0] - x, path[:, 1] - y).min()
        assert away >= min(r, math.hypot(x, y)) - 3e-4


def test_the_velocity_is_kept_where_nothing_is_near() -> None:
    far = np.array([(2.0, 0.0, 0.3)])
    for standing in (far, np.empty((0, 3))):
        assert clear_velocity((0.8, 0.0), GOAL_M, 0.0, Speeds(), BASE, TICK_S, standing) == (
            (0.8, 0.0), 1.0,
        )  # fmt: skip


def test_what_is_in_contact_already_is_left() -> None:
    behind = np.array([(-0.29, 0.0, 0.3)])
    found = clear_velocity((0.8, 0.0), GOAL_M, 0.0, Speeds(), BASE, TICK_S, behind)
    assert found == ((0.8, 0.0), 1.0)


def test_ahead_it_slows_down_and_what_is_grazed_is_passed() -> None:
    speeds = Speeds(0.3, 0.0)
    ahead = np.array([(0.4, 0.0, 0.3)])
    chosen, share = clear_velocity((0.8, 0.0), GOAL_M, 0.0, speeds, BASE, TICK_S, ahead)
    assert share in SHARES[1:]
    assert chosen == pytest.approx((0.8 * share, 0.0))


@settings(max_examples=25, deadline=None)
@example(0.27734375, -1.0, 0.03125)
@given(st.floats(0.275, 0.298), st.sampled_from([-1.0, 1.0]), st.floats(-0.7, 0.7))
def test_what_is_grazed_is_passed(beside_m: float, side: float, yaw: float) -> None:
    """The edge of something in front of it, up to which it has driven already."""
    ahead_m = math.sqrt(0.3003**2 - beside_m**2)
    pose, speeds = Pose2D(0.0, 0.0, yaw), Speeds()
    for _ in range(100):
        standing = np.array([(ahead_m - pose.x, side * beside_m - pose.y, 0.3)])
        chosen, _ = clear_velocity((0.8, 0.0), GOAL_M, pose.yaw, speeds, BASE, TICK_S, standing)
        commanded = heading_law(chosen, GOAL_M, pose.yaw, BASE, TICK_S)
        pose, speeds = apply_command(pose, speeds, commanded, BASE, 100_000_000)
        assert math.hypot(ahead_m - pose.x, side * beside_m - pose.y) > 0.297
    assert pose.x > ahead_m + 0.3


def test_where_it_cannot_drive_yet_it_turns_in_place_and_stops_only_along_its_heading() -> None:
    closed = np.array([(0.3, y, 0.3) for y in (-0.2, -0.1, 0.0, 0.1, 0.2)])
    for yaw, turns in ((0.5, -1.0), (-0.5, 1.0), (0.0, 0.0)):
        chosen, _ = clear_velocity((0.8, 0.0), GOAL_M, yaw, Speeds(), BASE, TICK_S, closed)
        speeds = heading_law(chosen, GOAL_M, yaw, BASE, TICK_S)
        assert abs(speeds.v) < 0.005
        assert np.sign(speeds.omega) == turns
