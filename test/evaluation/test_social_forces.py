# SPDX-License-Identifier: Apache-2.0
"""Pedestrians by social forces: the force is a gradient, people evade, pieces follow the path."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.evaluation.suites import suite
from mfba_planner.evaluation.suites.social_forces import (
    BEHIND,
    CUT_M,
    RANGE_M,
    REPULSION_M2PS2,
    STEP_S,
    STRIDE_S,
    PedestrianParams,
    obstacle_of,
    pedestrian_obstacles,
    repulsion,
    trajectories,
)
from mfba_planner.simulation.obstacle_motion import center_at

NEAR = st.floats(-1.5, 1.5)


def potential(x: float, y: float, other_velocity: tuple[float, float]) -> float:
    """V(b) of the paper for a person at (x, y) and another one at the origin."""
    sx, sy = (STRIDE_S * v for v in other_velocity)
    lengths = math.hypot(x, y) + math.hypot(x - sx, y - sy)
    b = 0.5 * math.sqrt(lengths**2 - sx**2 - sy**2)
    return REPULSION_M2PS2 * math.exp(-b / RANGE_M)


@settings(max_examples=60)
@given(x=st.floats(0.3, 1.5), y=NEAR, vx=NEAR, vy=NEAR)
def test_the_force_is_the_negative_gradient_of_the_potential(
    x: float, y: float, vx: float, vy: float
) -> None:
    sx, sy = STRIDE_S * vx, STRIDE_S * vy
    semi_minor = 0.5 * math.sqrt(
        max((math.hypot(x, y) + math.hypot(x - sx, y - sy)) ** 2 - sx**2 - sy**2, 0.0)
    )
    if semi_minor < 0.1 or math.hypot(x - sx, y - sy) < 0.05:
        return  # on the line of the other's step the potential has a kink
    h = 1e-6
    gradient = (
        (potential(x + h, y, (vx, vy)) - potential(x - h, y, (vx, vy))) / (2.0 * h),
        (potential(x, y + h, (vx, vy)) - potential(x, y - h, (vx, vy))) / (2.0 * h),
    )
    people = np.array([[x, y], [0.0, 0.0]])
    velocities = np.array([[0.0, 0.0], [vx, vy]])
    towards = np.array([gradient, (1.0, 0.0)])  # so that the other is in view
    towards /= np.maximum(np.hypot(*towards.T)[:, None], 1e-12)
    found = repulsion(people, velocities, towards)[0]
    assert found == pytest.approx([-g for g in gradient], rel=1e-3, abs=1e-6)
    unseen = repulsion(people, velocities, -towards)[0]
    assert unseen == pytest.approx(BEHIND * found)


def test_two_people_meet_pass_each_other_and_go_on() -> None:
    starts = np.array([[0.0, 0.0], [10.0, 0.1]])
    targets = np.array([[50.0, 0.0], [-40.0, 0.1]])
    paths = trajectories(starts, targets, np.array([1.3, 1.3]), 15.0)
    apart = np.hypot(*(paths[:, 0] - paths[:, 1]).T)
    assert 0.4 < apart.min() < 2.0
    assert np.abs(paths[:, :, 1]).max() > 0.2, "they evade"
    assert paths[-1, 0, 0] > 15.0
    assert paths[-1, 1, 0] < -5.0


def test_a_person_alone_walks_straight_at_the_desired_speed() -> None:
    paths = trajectories(np.array([[1.0, 2.0]]), np.array([[31.0, 42.0]]), np.array([1.25]), 8.0)
    expected = [1.0 + 0.6 * 1.25 * 8.0, 2.0 + 0.8 * 1.25 * 8.0]
    assert paths[-1, 0] == pytest.approx(expected, abs=1e-3)


def test_obstacles_follow_the_trajectories() -> None:
    rng = np.random.Generator(np.random.PCG64(4))
    paths = trajectories(
        rng.uniform(-3.0, 3.0, (6, 2)), rng.uniform(-40.0, 40.0, (6, 2)), np.full(6, 1.3), 12.0
    )
    for path in np.moveaxis(paths, 1, 0):
        obstacle = obstacle_of(path.tolist(), STEP_S, 0.25)
        off = [math.dist(center_at(obstacle, k * STEP_S), at) for k, at in enumerate(path)]
        assert max(off) <= CUT_M + 1e-6
        assert len(obstacle.turns) < len(path) / 2, "straight pieces are joined"


def test_the_suite_is_a_crowd_in_the_room_while_the_robot_drives() -> None:
    counts, speeds = [], []
    for k in range(5):
        world = suite("pedestrians").world(k)
        assert len(world.obstacles) == 24
        for t in (2.0, 8.0, 14.0):
            inside = [c for c in world.centers(t) if min(c) >= 0.0 and max(c) <= 12.0]
            counts.append(len(inside))
        speeds += [o.speed_mps for o in world.obstacles]
    assert 4 <= np.mean(counts) <= 20
    assert np.mean(speeds) == pytest.approx(1.3, abs=0.15)
    rng = np.random.Generator(np.random.PCG64(0))
    assert pedestrian_obstacles(PedestrianParams(pedestrians=0), rng) == ()
