# SPDX-License-Identifier: Apache-2.0
"""Closed-form motion against stepwise motion, and contact against dense sampling."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point
from mfba_planner.simulation.contact import step_clearances
from mfba_planner.simulation.obstacle_motion import (
    Obstacle,
    Turn,
    Walls,
    bounce_times,
    center_at,
    velocity_at,
)
from mfba_planner.simulation.scenario import Scenario

ROOM = Walls(lower_m=(-2.0, 1.0), upper_m=(4.0, 6.0))
RADII = st.floats(0.05, 1.0)
SPEEDS = st.floats(0.0, 2.0)
HEADINGS = st.floats(-10.0, 10.0)
TIMES = st.floats(0.0, 200.0)
POINTS = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
FREE = st.builds(Obstacle, center_m=POINTS, radius_m=RADII, speed_mps=SPEEDS, heading_rad=HEADINGS)


@st.composite
def walled(draw: st.DrawFn) -> Obstacle:
    """An obstacle inside ROOM."""
    radius = draw(RADII)
    x = draw(st.floats(-2.0 + radius, 4.0 - radius))
    y = draw(st.floats(1.0 + radius, 6.0 - radius))
    return Obstacle(
        center_m=(x, y), radius_m=radius, speed_mps=draw(SPEEDS), heading_rad=draw(HEADINGS)
    )


def mover(center: Point, degrees: float, speed: float = 1.0, radius: float = 0.5) -> Obstacle:
    return Obstacle(
        center_m=center, radius_m=radius, speed_mps=speed, heading_rad=math.radians(degrees)
    )


def stepwise(obstacle: Obstacle, walls: Walls, t: float, steps: int) -> Point:
    """The same motion in small steps, reversed at walls."""
    position, velocity = list(obstacle.center_m), list(obstacle.velocity)
    for _ in range(steps):
        for axis in (0, 1):
            position[axis] += velocity[axis] * t / steps
            low = walls.lower_m[axis] + obstacle.radius_m
            high = walls.upper_m[axis] - obstacle.radius_m
            if position[axis] > high:
                position[axis], velocity[axis] = 2.0 * high - position[axis], -velocity[axis]
            if position[axis] < low:
                position[axis], velocity[axis] = 2.0 * low - position[axis], -velocity[axis]
    return (position[0], position[1])


# --- motion -----------------------------------------------------------------------------------


def test_obstacle_1_of_case_study_1() -> None:
    obstacle = Obstacle(center_m=(1.0, 4.5), radius_m=0.3, speed_mps=0.3, heading_rad=0.0)
    assert obstacle.velocity == (0.3, 0.0)
    assert center_at(obstacle, 0.0) == (1.0, 4.5)
    assert center_at(obstacle, 10.0) == (4.0, 4.5)


def test_headings_are_counter_clockwise() -> None:
    assert mover((0.0, 0.0), 30.0, 2.0).velocity == pytest.approx((3.0**0.5, 1.0))
    assert center_at(mover((1.0, 1.0), 270.0), 3.0) == pytest.approx((1.0, -2.0))


def test_an_obstacle_at_rest_stays() -> None:
    still = Obstacle(center_m=(1.0, 2.0), radius_m=0.3)
    assert center_at(still, 1e6) == center_at(still, 1e6, ROOM) == (1.0, 2.0)


@pytest.mark.parametrize(
    ("t", "x"),
    [(0.0, 0.0), (1.0, 1.0), (3.5, 3.5), (4.0, 3.0), (8.5, -1.5), (9.0, -1.0), (10.0, 0.0)],
)
def test_bounces_by_hand(t: float, x: float) -> None:
    # between -1.5 and 3.5: there and back in 10 s
    assert center_at(mover((0.0, 2.0), 0.0), t, ROOM) == pytest.approx((x, 2.0))
    assert center_at(mover((0.0, 2.0), 0.0), t + 1000.0, ROOM) == pytest.approx((x, 2.0))
    assert center_at(mover((0.0, 2.0), 180.0), 10.0 - t, ROOM) == pytest.approx((x, 2.0))


def test_axes_bounce_apart() -> None:
    # y runs between 1.5 and 5.5
    obstacle = mover((0.0, 2.0), 45.0, math.sqrt(2.0))
    assert center_at(obstacle, 4.0, ROOM) == pytest.approx((3.0, 5.0))
    assert center_at(obstacle, 8.0, ROOM) == pytest.approx((-1.0, 2.0))


@given(FREE, TIMES)
def test_free_motion_against_stepwise_motion(obstacle: Obstacle, t: float) -> None:
    far = Walls(lower_m=(-1e4, -1e4), upper_m=(1e4, 1e4))
    expected = stepwise(obstacle, far, t, 7)
    assert center_at(obstacle, t) == pytest.approx(expected, abs=1e-9)
    assert center_at(obstacle, t, far) == pytest.approx(expected, abs=1e-9)


@given(walled(), TIMES)
def test_bouncing_motion_against_stepwise_motion(obstacle: Obstacle, t: float) -> None:
    # one bounce per axis and step at the most: the room is over 3 m wide
    steps = 1 + int(t * obstacle.speed_mps)
    expected = stepwise(obstacle, ROOM, t, steps)
    assert center_at(obstacle, t, ROOM) == pytest.approx(expected, abs=1e-7)


@given(walled(), st.floats(0.0, 1e7))
def test_walls_are_never_left(obstacle: Obstacle, t: float) -> None:
    for axis, value in enumerate(center_at(obstacle, t, ROOM)):
        assert ROOM.lower_m[axis] + obstacle.radius_m <= value
        assert value <= ROOM.upper_m[axis] - obstacle.radius_m


@given(walled())
def test_every_motion_starts_at_its_center(obstacle: Obstacle) -> None:
    assert center_at(obstacle, 0.0, ROOM) == center_at(obstacle, 0.0) == obstacle.center_m


def test_a_room_hardly_wider_than_the_obstacle() -> None:
    corridor = Walls(lower_m=(0.0, 0.0), upper_m=(1.25, 9.0))  # x runs from 0.5 to 0.75
    obstacle = mover((0.5, 2.0), 0.0)
    xs = [center_at(obstacle, t, corridor)[0] for t in (0.125, 0.25, 0.375, 0.5, 1.125)]
    assert xs == [0.625, 0.75, 0.625, 0.5, 0.625]
    assert bounce_times(obstacle, 0.1, 0.9, corridor) == [0.25, 0.5, 0.75]


def test_an_obstacle_that_fills_the_room_stays() -> None:
    tight = Walls(lower_m=(0.0, 0.0), upper_m=(1.0, 9.0))
    obstacle = mover((0.5, 2.0), 45.0, math.sqrt(2.0))
    assert center_at(obstacle, 3.0, tight) == pytest.approx((0.5, 5.0))
    assert bounce_times(obstacle, 0.0, 3.0, tight) == []
    assert bounce_times(obstacle, 0.0, 7.0, tight) == pytest.approx([6.5])


# --- bounces ----------------------------------------------------------------------------------


def test_bounce_times_by_hand() -> None:
    obstacle = mover((0.0, 2.0), 0.0)
    assert bounce_times(obstacle, 0.0, 20.0, ROOM) == pytest.approx([3.5, 8.5, 13.5, 18.5])
    assert bounce_times(obstacle, 4.0, 9.0, ROOM) == pytest.approx([8.5])
    assert bounce_times(obstacle, 4.0, 8.0, ROOM) == []
    assert bounce_times(mover((0.0, 2.0), 180.0), 0.0, 7.0, ROOM) == pytest.approx([1.5, 6.5])
    both = mover((0.0, 2.5), 45.0, math.sqrt(2.0))
    assert bounce_times(both, 0.0, 9.0, ROOM) == pytest.approx([3.0, 3.5, 7.0, 8.5])


def test_the_ends_of_the_interval_do_not_count() -> None:
    obstacle = mover((0.0, 2.0), 0.0)
    assert bounce_times(obstacle, 3.5, 8.5, ROOM) == []
    # 3.5 m by 0.5 m/s, exact in floats, on both axes at once
    corner = Walls(lower_m=(-4.0, -4.0), upper_m=(4.0, 4.0))
    diagonal = Obstacle(center_m=(0.0, 0.0), radius_m=0.5, speed_mps=1.0, heading_rad=0.0)
    assert bounce_times(diagonal, 0.0, 3.6, corner) == [3.5]
    assert bounce_times(diagonal, 0.0, 3.5, corner) == []
    assert bounce_times(diagonal, 3.5, 3.6, corner) == []


def test_no_walls_or_no_motion_no_bounce() -> None:
    assert bounce_times(mover((0.0, 2.0), 0.0), 0.0, 99.0, None) == []
    assert bounce_times(mover((0.0, 2.0), 0.0, speed=0.0), 0.0, 99.0, ROOM) == []


def test_a_corner_is_a_single_bounce() -> None:
    square = Walls(lower_m=(0.0, 0.0), upper_m=(4.0, 4.0))
    obstacle = Obstacle(
        center_m=(2.0, 2.0), radius_m=0.5, speed_mps=1.0, heading_rad=math.radians(45.0)
    )
    times = bounce_times(obstacle, 0.0, 4.0, square)
    assert times == pytest.approx([1.5 * math.sqrt(2.0)] * len(times))
    assert 1 <= len(times) <= 2, "at most twice, by rounding"


@given(walled(), TIMES, st.floats(0.0, 20.0))
def test_between_two_bounces_motion_is_straight(
    obstacle: Obstacle, t0: float, duration: float
) -> None:
    t1 = t0 + duration
    times = bounce_times(obstacle, t0, t1, ROOM)
    assert times == sorted(times)
    assert all(t0 < t < t1 for t in times)
    for ta, tb in pairwise([t0, *times, t1]):
        a, m, b = (center_at(obstacle, t, ROOM) for t in (ta, (ta + tb) / 2.0, tb))
        assert m == pytest.approx(((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0), abs=1e-6)


@given(walled(), TIMES, st.floats(0.0, 20.0))
def test_at_a_bounce_the_obstacle_touches_a_wall(
    obstacle: Obstacle, t0: float, duration: float
) -> None:
    for t in bounce_times(obstacle, t0, t0 + duration, ROOM):
        gaps = [
            min(value - low, high - value) - obstacle.radius_m
            for value, low, high in zip(center_at(obstacle, t, ROOM), ROOM.lower_m, ROOM.upper_m)
        ]
        assert min(gaps) == pytest.approx(0.0, abs=1e-6)


# --- turns ------------------------------------------------------------------------------------

TURNS = st.lists(
    st.tuples(st.floats(0.01, 30.0), SPEEDS, HEADINGS),
    min_size=1,
    max_size=5,
    unique_by=lambda row: row[0],
).map(lambda rows: tuple(Turn(at_s=t, speed_mps=v, heading_rad=h) for t, v, h in sorted(rows)))


def turner() -> Obstacle:
    """East; from 2 s on north at twice the speed; at rest from 3 to 5 s; then west."""
    return Obstacle(
        center_m=(0.0, 2.0),
        radius_m=0.5,
        speed_mps=1.0,
        turns=(
            Turn(at_s=2.0, speed_mps=2.0, heading_rad=math.pi / 2.0),
            Turn(at_s=3.0, speed_mps=0.0),
            Turn(at_s=5.0, speed_mps=1.0, heading_rad=math.pi),
        ),
    )


@pytest.mark.parametrize(
    ("t", "center"),
    [
        (0.0, (0.0, 2.0)),
        (-1.0, (-1.0, 2.0)),
        (2.0, (2.0, 2.0)),
        (2.5, (2.0, 3.0)),
        (3.0, (2.0, 4.0)),
        (4.0, (2.0, 4.0)),
        (6.5, (0.5, 4.0)),
    ],
)
def test_turns_by_hand(t: float, center: Point) -> None:
    assert center_at(turner(), t) == pytest.approx(center)
    assert turner().top_speed_mps == 2.0


def test_a_turn_after_a_bounce_has_its_own_heading() -> None:
    # at the wall x = 3.5 after 1 s, back at 2.5 after 2 s; then east again
    obstacle = Obstacle(
        center_m=(2.5, 2.0), radius_m=0.5, speed_mps=1.0, turns=(Turn(at_s=2.0, speed_mps=1.0),)
    )
    assert center_at(obstacle, 2.5, ROOM) == pytest.approx((3.0, 2.0))
    assert center_at(obstacle, 3.5, ROOM) == pytest.approx((3.0, 2.0))
    assert bounce_times(obstacle, 0.0, 4.0, ROOM) == pytest.approx([1.0, 2.0, 3.0])


def test_turns_are_kinks_between_the_ends() -> None:
    assert bounce_times(turner(), 0.0, 9.0, None) == [2.0, 3.0, 5.0]
    assert bounce_times(turner(), 2.0, 5.0, None) == [3.0]
    assert bounce_times(turner(), 2.5, 5.5, ROOM) == pytest.approx([3.0, 5.0])


@given(walled(), TURNS, st.booleans(), TIMES, st.floats(0.0, 20.0))
def test_between_two_kinks_motion_is_straight_and_joined(
    plain: Obstacle, turns: tuple[Turn, ...], closed: bool, t0: float, duration: float
) -> None:
    obstacle = replace(plain, turns=turns)
    walls = ROOM if closed else None
    times = bounce_times(obstacle, t0, t0 + duration, walls)
    assert all(t0 < t < t0 + duration for t in times)
    assert {turn.at_s for turn in turns if t0 < turn.at_s < t0 + duration} <= set(times)
    for ta, tb in pairwise([t0, *times, t0 + duration]):
        a, m, b = (center_at(obstacle, t, walls) for t in (ta, (ta + tb) / 2.0, tb))
        assert m == pytest.approx(((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0), abs=1e-6)
        if tb - ta > 1e-3:
            vx, vy = velocity_at(obstacle, (ta + tb) / 2.0, walls)
            expected = ((b[0] - a[0]) / (tb - ta), (b[1] - a[1]) / (tb - ta))
            assert (vx, vy) == pytest.approx(expected, abs=1e-6)


def test_at_a_wall_or_a_turn_the_velocity_is_the_later_one() -> None:
    east, west = mover((0.0, 2.0), 0.0), mover((0.0, 2.0), 180.0)
    assert velocity_at(east, 3.5, ROOM) == pytest.approx((-1.0, 0.0))
    assert velocity_at(west, 1.5, ROOM) == pytest.approx((1.0, 0.0))
    assert velocity_at(east, 3.5) == (1.0, 0.0)
    assert velocity_at(turner(), 2.0) == pytest.approx((0.0, 2.0))
    assert velocity_at(turner(), 3.0) == (0.0, 0.0)
    tight = Walls(lower_m=(0.0, 0.0), upper_m=(1.0, 9.0))
    assert velocity_at(mover((0.5, 2.0), 45.0), 0.0, tight)[0] == 0.0


def test_a_contact_just_at_a_turn_is_noticed() -> None:
    # comes to within 0.1 m of the robot's centre line at 2 s and leaves again
    obstacle = Obstacle(
        center_m=(0.0, 0.0),
        radius_m=0.5,
        speed_mps=1.0,
        turns=(Turn(at_s=2.0, speed_mps=1.0, heading_rad=math.pi),),
    )
    gap = step_clearances(world(obstacle), 0.0, 4.0, (2.1, 0.0), (2.1, 0.0))
    assert gap == pytest.approx([0.1 - 0.8])


# --- contact ----------------------------------------------------------------------------------


def world(*obstacles: Obstacle, walls: Walls | None = None) -> Scenario:
    return Scenario(
        name="x", start_m=(99.0, 99.0), goal_m=(98.0, 99.0), obstacles=obstacles, walls=walls
    )


def test_a_step_between_two_posts_by_hand() -> None:
    posts = [mover((2.0, 2.0), 0.0, speed=0.0), mover((5.0, -4.0), 0.0, speed=0.0, radius=1.0)]
    gaps = step_clearances(world(*posts), 0.0, 1.0, (0.0, 0.0), (4.0, 0.0))
    assert gaps == pytest.approx([2.0 - 0.8, math.sqrt(17.0) - 1.3])


def test_a_contact_in_mid_step_is_noticed() -> None:
    post = mover((2.0, 0.0), 0.0, speed=0.0)
    assert step_clearances(world(post), 0.0, 1.0, (0.0, 0.0), (4.0, 0.0)) == [-0.8]


def test_obstacles_move_during_the_step() -> None:
    # both are at (2, 0) after 2 s
    runner = mover((2.0, -2.0), 90.0)
    gap = step_clearances(world(runner), 0.0, 4.0, (0.0, 0.0), (4.0, 0.0))
    assert gap == pytest.approx([-0.8])
    late = step_clearances(world(runner), 10.0, 14.0, (0.0, 0.0), (4.0, 0.0))
    assert late == pytest.approx([math.sqrt(4.0 + 64.0) - 0.8])


def test_a_bounce_within_the_step_is_followed() -> None:
    # x = 3.5 at 3.5 s, then back: a robot that waits at x = 3.6 is closest at the bounce
    waiting = (3.6, 2.0)
    gap = step_clearances(world(mover((0.0, 2.0), 0.0), walls=ROOM), 3.0, 4.0, waiting, waiting)
    assert gap == pytest.approx([0.1 - 0.8])


def test_without_time_the_gap_is_that_of_the_moment() -> None:
    post = mover((2.0, 0.0), 0.0)
    for end in ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0)):  # for any end of the step
        assert step_clearances(world(post), 1.0, 1.0, (0.0, 0.0), end) == [3.0 - 0.8]


def test_no_obstacles_no_gaps() -> None:
    assert step_clearances(world(), 0.0, 1.0, (0.0, 0.0), (4.0, 0.0)) == []


@given(walled(), TIMES, st.floats(0.01, 6.0), POINTS, POINTS, st.booleans())
def test_clearance_against_dense_sampling(
    obstacle: Obstacle, t0: float, duration: float, start: Point, end: Point, closed: bool
) -> None:
    walls = ROOM if closed else None
    n = 400
    samples = []
    for k in range(n + 1):
        s = k / n
        robot = (start[0] + s * (end[0] - start[0]), start[1] + s * (end[1] - start[1]))
        samples.append(math.dist(robot, center_at(obstacle, t0 + s * duration, walls)))
    enlarged = obstacle.radius_m + 0.3
    (gap,) = step_clearances(world(obstacle, walls=walls), t0, t0 + duration, start, end)
    travel_m = math.dist(start, end) + obstacle.speed_mps * duration
    assert gap <= min(samples) - enlarged + 1e-6
    assert gap >= min(samples) - enlarged - travel_m / n - 1e-6


# --- scenarios --------------------------------------------------------------------------------


def test_defaults() -> None:
    scenario = Scenario(name="x", start_m=(0.0, 0.0), goal_m=(1.0, 0.0))
    assert (scenario.robot_radius_m, scenario.time_limit_s) == (0.3, 120.0)
    assert (scenario.obstacles, scenario.walls, scenario.description) == ((), None, "")
    still = Obstacle(center_m=(1.0, 2.0), radius_m=0.3)
    assert (still.speed_mps, still.heading_rad) == (0.0, 0.0)


def test_centers_and_enlarged_circles_as_in_the_scenario() -> None:
    first, second = mover((0.0, 3.0), 0.0), mover((1.0, 4.0), 90.0, radius=0.25)
    scenario = world(first, second)
    assert scenario.enlarged_radius(second) == 0.55
    assert scenario.centers(2.0)[0] == pytest.approx((2.0, 3.0))
    assert scenario.centers(2.0)[1] == pytest.approx((1.0, 6.0))
    assert [radius for _, radius in scenario.enlarged(2.0)] == [0.8, 0.55]
    assert [center for center, _ in scenario.enlarged(2.0)] == scenario.centers(2.0)
    bounced = world(first, second, walls=ROOM)
    assert bounced.centers(2.0)[1] == pytest.approx((1.0, 5.5))
    assert [center for center, _ in bounced.enlarged(2.0)] == bounced.centers(2.0)


def refusal(**changes: Any) -> str:
    plain: dict[str, Any] = {"name": "x", "start_m": (0.0, 0.0), "goal_m": (5.0, 5.0)}
    with pytest.raises(ConfigError) as caught:
        Scenario(**{**plain, **changes})
    return str(caught.value)


def test_a_goal_at_the_start_is_refused() -> None:
    assert refusal(goal_m=(0.0, 0.0)) == "goal_m=[0.0, 0.0]: equal to start_m; move one of them"


def test_a_start_inside_an_obstacle_is_refused() -> None:
    posts = (mover((3.0, 3.0), 0.0), mover((0.0, 0.5), 0.0))
    assert refusal(obstacles=posts) == (
        "start_m=[0.0, 0.0]: the robot starts 0.3 m inside obstacle 2 (radii added); "
        "move start_m or the obstacle"
    )


def test_a_start_that_touches_an_obstacle_is_not_inside() -> None:
    touching = mover((0.75, 0.0), 0.0)
    plain: dict[str, Any] = {"name": "x", "start_m": (0.0, 0.0), "goal_m": (5.0, 5.0)}
    assert Scenario(**plain, robot_radius_m=0.25, obstacles=(touching,)).obstacles
    assert "inside obstacle 1" in refusal(robot_radius_m=0.26, obstacles=(touching,))


@pytest.mark.parametrize("center", [(3.6, 3.0), (-1.6, 3.0), (1.0, 1.4), (1.0, 5.6), (9.0, 9.0)])
def test_an_obstacle_in_a_wall_is_refused(center: Point) -> None:
    posts = (mover((1.0, 3.0), 0.0), mover(center, 0.0))
    assert refusal(start_m=(9.0, 0.0), obstacles=posts, walls=ROOM) == (
        f"obstacle 2 center_m={list(center)}: not inside the walls; move it or widen the walls"
    )


def test_an_obstacle_may_touch_a_wall_and_a_goal_may_lie_in_an_obstacle() -> None:
    corner = mover((3.5, 5.5), 45.0)
    scenario = Scenario(
        name="x", start_m=(0.0, 0.0), goal_m=(3.5, 5.5), obstacles=(corner,), walls=ROOM
    )
    assert scenario.centers(0.0) == [(3.5, 5.5)]


@given(FREE)
def test_obstacles_are_values(obstacle: Obstacle) -> None:
    assume(obstacle.speed_mps > 0.0)
    with pytest.raises(AttributeError):
        obstacle.speed_mps = 0.0  # type: ignore[misc]


@pytest.mark.parametrize("times", [(2.0, 1.0), (1.0, 1.0), (0.0,), (math.nan,)])
def test_turns_not_sorted_by_time_are_refused(times: tuple[float, ...]) -> None:
    post = Obstacle(
        center_m=(3.0, 3.0),
        radius_m=0.3,
        turns=tuple(Turn(at_s=t, speed_mps=1.0) for t in times),
    )
    message = refusal(obstacles=(mover((3.0, 1.0), 0.0), post))
    assert message.startswith("obstacle 2 turns: at_s=")
    assert message.endswith("sort the turns by time, the first after 0")
