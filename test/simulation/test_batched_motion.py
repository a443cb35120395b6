# SPDX-License-Identifier: Apache-2.0
"""batched_motion equals obstacle_motion and contact, bit for bit."""

import math
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.simulation.batched_motion import Motion
from mfba_planner.simulation.contact import step_clearances
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn, Walls, center_at
from mfba_planner.simulation.scenario import Scenario

ROOM = Walls(lower_m=(-2.0, 1.0), upper_m=(4.0, 6.0))
SPEEDS, HEADINGS = st.floats(0.0, 3.0), st.floats(-10.0, 10.0)


@st.composite
def obstacles(draw: st.DrawFn) -> Obstacle:
    """An obstacle that fits into ROOM, with or without turns."""
    radius = draw(st.sampled_from([0.05, 0.3, 0.999]))
    times = sorted(draw(st.sets(st.floats(0.1, 20.0), max_size=3)))
    return Obstacle(
        center_m=(
            draw(st.floats(-2.0 + radius, 4.0 - radius)),
            draw(st.floats(1.0 + radius, 6.0 - radius)),
        ),
        radius_m=radius,
        speed_mps=draw(SPEEDS),
        heading_rad=draw(HEADINGS),
        turns=tuple(
            Turn(at_s=t, speed_mps=draw(SPEEDS), heading_rad=draw(HEADINGS)) for t in times
        ),
    )


def scenario(crowd: list[Obstacle], walled: bool) -> Scenario:
    return Scenario(
        name="x",
        start_m=(-50.0, -50.0),
        goal_m=(0.0, 0.0),
        obstacles=tuple(crowd),
        walls=ROOM if walled else None,
    )


@settings(max_examples=150)
@given(
    crowd=st.lists(obstacles(), max_size=4),
    walled=st.booleans(),
    times=st.lists(st.floats(0.0, 100.0), min_size=1, max_size=5),
)
def test_centers_equal_center_at(crowd: list[Obstacle], walled: bool, times: list[float]) -> None:
    world = scenario(crowd, walled)
    found = Motion(world).centers(np.array(times))
    assert found.shape == (2, len(times), len(crowd))
    for k, t in enumerate(times):
        for i, obstacle in enumerate(crowd):
            assert tuple(found[:, k, i].tolist()) == center_at(obstacle, t, world.walls)


@settings(max_examples=150)
@given(
    crowd=st.lists(obstacles(), min_size=1, max_size=4),
    walled=st.booleans(),
    start=st.floats(0.0, 30.0),
    durations=st.lists(st.floats(1e-3, 5.0), min_size=1, max_size=5),
    data=st.data(),
)
def test_gaps_equal_step_clearances(
    crowd: list[Obstacle],
    walled: bool,
    start: float,
    durations: list[float],
    data: st.DataObject,
) -> None:
    world = scenario(crowd, walled)
    times = [start]
    for duration in durations:
        times.append(times[-1] + duration)
    points = st.tuples(st.floats(-3.0, 5.0), st.floats(0.0, 7.0))
    positions = [data.draw(points) for _ in times]
    steps = Motion(world).steps(np.array(times), np.array(positions).T)
    for k, ((t0, a), (t1, b)) in enumerate(pairwise(zip(times, positions))):
        assert steps.gap_m[k].tolist() == step_clearances(world, t0, t1, a, b)
    for k, (t, position) in enumerate(zip(times, positions)):
        for i, obstacle in enumerate(crowd):
            center = center_at(obstacle, t, world.walls)
            dx, dy = center[0] - position[0], center[1] - position[1]
            assert steps.distance_m[k, i] == math.sqrt(dx * dx + dy * dy)


def test_a_room_without_room_to_move() -> None:
    tight = Walls(lower_m=(0.0, 0.0), upper_m=(1.0, 9.0))
    stuck = Obstacle(center_m=(0.5, 4.0), radius_m=0.5, speed_mps=1.0, heading_rad=0.3)
    world = Scenario(
        name="x", start_m=(5.0, 5.0), goal_m=(6.0, 5.0), obstacles=(stuck,), walls=tight
    )
    times = np.array([0.0, 3.0, 17.0])
    x, y = Motion(world).centers(times)[:, :, 0]
    assert x.tolist() == [0.5, 0.5, 0.5]
    assert y.tolist() == [center_at(stuck, t, tight)[1] for t in times.tolist()]
    steps = Motion(world).steps(times, np.full((2, 3), 5.0))
    expected = [step_clearances(world, 0.0, 3.0, (5.0, 5.0), (5.0, 5.0))]
    assert steps.gap_m[:1].tolist() == expected


def test_a_scenario_without_obstacles() -> None:
    found = Motion(scenario([], True)).steps(np.array([0.0, 1.0]), np.zeros((2, 2)))
    assert found.gap_m.shape == (1, 0)
