# SPDX-License-Identifier: Apache-2.0
"""Recorded trajectories and absences: exact at the knots, in contact, for sensors and oracle."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import distance
from mfba_planner.evaluation.metrics import evaluate, within_range
from mfba_planner.evaluation.oracle import solve
from mfba_planner.evaluation.oracle.path_check import pieces as checked_pieces
from mfba_planner.evaluation.oracle.solution import Certificate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.peers.straight_line import Straight
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.simulation.batched_motion import Motion
from mfba_planner.simulation.constant_velocity_segments import uniform_segments
from mfba_planner.simulation.contact import clearance
from mfba_planner.simulation.nearby_obstacles import FEW, NearbyObstacles
from mfba_planner.simulation.obstacle_motion import (
    Obstacle,
    Walls,
    bounce_times,
    center_at,
    pieces,
    velocity_at,
)
from mfba_planner.simulation.planner_observations import Perception
from mfba_planner.simulation.recorded_motion import (
    SHORTEST_LOOP_S,
    Knot,
    is_present,
    presence,
)
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.world import World

KNOTS: tuple[Knot, ...] = ((1.0, 5.0, 0.1), (2.3, 6.1, 0.7), (2.9, 6.1, 0.7), (4.0, 3.3, -2.0))


def recorded(**changes: object) -> Obstacle:
    plain = Obstacle(center_m=KNOTS[0][1:], radius_m=0.3, trajectory=KNOTS)
    return replace(plain, **changes)  # type: ignore[arg-type]


def scenario(*obstacles: Obstacle, walls: Walls | None = None, **more: object) -> Scenario:
    return Scenario(
        name="recorded", start_m=(0.0, 0.0), goal_m=(9.0, 0.0), obstacles=obstacles, walls=walls,
        **more,  # type: ignore[arg-type]
    )  # fmt: skip


def random_obstacles(rng: np.random.Generator, count: int) -> tuple[Obstacle, ...]:
    """Of every kind: recorded, looping, staying, appearing, vanishing, and ordinary ones."""
    found = []
    for k in range(count):
        stamps = np.cumsum(rng.uniform(0.11, 1.5, rng.integers(2, 9))) + rng.uniform(-2.0, 3.0)
        points = rng.uniform(2.0, 9.0, (len(stamps), 2))
        knots = tuple(
            (float(t), float(x), float(y)) for t, (x, y) in zip(stamps, points, strict=True)
        )
        one = Obstacle(center_m=knots[0][1:], radius_m=0.3, trajectory=knots)
        kind = k % 5
        if kind == 0:
            one = replace(one, loop=True)
        elif kind == 1:
            one = replace(one, stays=True)
        elif kind == 2:
            one = Obstacle(center_m=knots[0][1:], radius_m=0.3, speed_mps=1.7, heading_rad=1.0)
        if k % 3 == 0:
            begin = float(rng.uniform(0.0, 2.0))
            one = replace(one, appears_s=begin, vanishes_s=begin + float(rng.uniform(0.1, 3.0)))
        found.append(one)
    return tuple(found)


def test_it_is_exact_at_the_knots_and_straight_between() -> None:
    one = recorded()
    for t, x, y in KNOTS:
        assert center_at(one, t) == (x, y)
    assert center_at(one, 2.6) == (6.1, 0.7)
    assert center_at(one, 1.65) == pytest.approx((5.55, 0.4))
    assert velocity_at(one, 1.0) == pytest.approx((1.1 / 1.3, 0.6 / 1.3))
    assert velocity_at(one, 2.3) == (0.0, 0.0)
    assert one.top_speed_mps == pytest.approx(math.hypot(2.8, 2.7) / 1.1)
    assert bounce_times(one, 0.0, 9.0, None) == [1.0, 2.3, 2.9, 4.0]


def test_it_is_there_from_its_first_knot_to_its_last() -> None:
    one = recorded()
    assert [is_present(one, t) for t in (0.999, 1.0, 4.0, 4.001)] == [False, True, True, False]
    assert presence(recorded(stays=True)) == (-math.inf, math.inf)
    assert presence(recorded(loop=True)) == (1.0, math.inf)
    assert presence(recorded(appears_s=2.0, vanishes_s=3.0)) == (2.0, 3.0)
    assert presence(recorded(loop=True, vanishes_s=99.0)) == (1.0, 99.0)
    standing = recorded(stays=True)
    assert (center_at(standing, 0.0), center_at(standing, 50.0)) == ((5.0, 0.1), (3.3, -2.0))
    assert velocity_at(standing, 50.0) == (0.0, 0.0)


def test_a_loop_begins_anew_with_a_jump() -> None:
    one = recorded(loop=True)  # a lap of 3 s
    for t in (1.0, 1.65, 3.4):
        assert center_at(one, t + 300.0) == pytest.approx(center_at(one, t))
    found = pieces(one, 3.5, 4.5, None)
    assert [(a, b) for a, b, *_ in found] == [(3.5, 4.0), (4.0, 4.5)]
    assert found[0][3] == (3.3, -2.0)  # the end of one lap and the begin of the next
    assert found[1][2] == (5.0, 0.1)
    assert bounce_times(one, 3.9, 7.5, None) == pytest.approx([4.0, 5.3, 5.9, 7.0])


def test_walls_do_not_stop_what_is_recorded() -> None:
    walls = Walls(lower_m=(0.0, -1.0), upper_m=(5.5, 5.0))
    assert center_at(recorded(), 2.3, walls) == (6.1, 0.7)
    xs, ys = Motion(scenario(recorded(stays=True), walls=walls)).centers(np.array([2.3, 9.0]))
    assert (xs[:, 0].tolist(), ys[:, 0].tolist()) == ([6.1, 3.3], [0.7, -2.0])


@pytest.mark.parametrize("seed", range(6))
def test_many_times_at_once_are_the_single_ones_bit_for_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    walls = Walls(lower_m=(0.5, 0.5), upper_m=(10.0, 10.0)) if seed % 2 else None
    world = scenario(*random_obstacles(rng, 20), walls=walls)
    times = np.concatenate([np.arange(60) * 0.13, [k[0] for k in world.obstacles[0].trajectory]])
    centers = Motion(world).centers(times)
    for k, t in enumerate(times.tolist()):
        assert np.array_equal(centers[:, k].T, np.array(world.centers(t)), equal_nan=True)


@pytest.mark.parametrize("seed", range(6))
def test_the_gap_of_a_step_is_that_of_dense_samples(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    walls = Walls(lower_m=(0.5, 0.5), upper_m=(10.0, 10.0)) if seed % 2 else None
    world = scenario(*random_obstacles(rng, 15), walls=walls)
    times = np.arange(21) * 0.37
    positions = rng.uniform(2.0, 9.0, (2, 21))
    steps = Motion(world).steps(times, positions)
    shares = np.linspace(0.0, 1.0, 2001)
    for k in range(20):
        a, b = positions[:, k], positions[:, k + 1]
        moments = times[k] + shares * (times[k + 1] - times[k])
        robot = a[:, None] + shares * (b - a)[:, None]
        xs, ys = Motion(world).centers(moments)
        away = np.hypot(xs - robot[0][:, None], ys - robot[1][:, None])
        sampled = np.where(np.isnan(away), np.inf, away).min(axis=0) - 0.6
        for i, obstacle in enumerate(world.obstacles):
            t0, t1 = times[k : k + 2].tolist()
            exact = clearance(world, obstacle, t0, t1, tuple(a.tolist()), tuple(b.tolist()))
            assert steps.gap_m[k, i] == pytest.approx(exact, abs=1e-12)
            if math.isinf(exact) or math.isinf(sampled[i]):  # there for less than a sample
                assert not is_present(obstacle, (t0 + t1) / 2.0)
            else:
                assert exact - 1e-9 <= sampled[i] <= exact + 0.03


def test_appearing_and_vanishing_are_exact_in_contact() -> None:
    stands = Obstacle(center_m=(4.0, 0.0), radius_m=0.3)  # the robot is over it at t = 4
    for begin, end, touched in (
        (0.0, 3.39, False), (0.0, 3.41, True), (4.59, None, True), (4.61, None, False),
        (3.9, 3.95, True),
    ):  # fmt: skip
        world = scenario(replace(stands, appears_s=begin, vanishes_s=end))
        times, positions = np.array([3.0, 5.0]), np.array([[3.0, 5.0], [0.0, 0.0]])
        gap = Motion(world).steps(times, positions).gap_m[0, 0]
        assert (gap < 0.0) == touched, (begin, end)


def test_what_is_absent_has_no_gap_no_distance_and_no_time_to_contact() -> None:
    world = scenario(recorded(), replace(recorded(), loop=True))
    steps = Motion(world).steps(np.array([0.0, 0.9, 1.1]), np.array([[5.0] * 3, [0.0] * 3]))
    assert np.isinf(steps.gap_m[0]).all()
    assert np.isinf(steps.contact_s[0]).all()
    assert np.isinf(steps.distance_m[:2]).all()
    assert (steps.gap_m[1] < 0.0).all()
    jump = Motion(world).steps(np.array([3.9, 4.1]), np.array([[4.1] * 2, [-1.0] * 2]))
    assert jump.contact_s[0, 1] == math.inf  # it does not pass between the ends of its laps
    assert jump.gap_m[0, 1] > 0.3


@pytest.mark.parametrize("count", [3, FEW + 10])
def test_what_is_absent_is_not_near(count: int) -> None:
    absent = replace(recorded(), appears_s=2.0)
    far = Obstacle(center_m=(500.0, 0.0), radius_m=0.3)
    world = scenario(far, absent, *[far] * (count - 2))
    near = NearbyObstacles(Motion(world), 10**8)
    for tick in range(60):
        which, circles = near.at(tick, (5.0, 0.0), 3.0)
        assert (1 in which) is (20 <= tick <= 40)
        assert len(which) == len(circles)
        assert not any(math.isnan(x) for (x, _), _ in circles)


def test_no_sensor_sees_what_is_absent() -> None:
    one = recorded(appears_s=1.5)
    robot = Robot(lidar=Lidar(beams=90, range_max_m=9.0))
    for tick, sensed in ((10, False), (16, True), (40, True), (41, False)):
        world = World(scenario(one, robot=robot), 10**8, 0.02)
        world.tick = tick
        reading = world.read()
        assert reading.scan is not None
        assert np.isfinite(reading.scan.ranges_m).any() == sensed
        assert len(world.centers()) == sensed
        known = Perception("known")(world, SensorParams(sensing_range_m=9.0))
        assert len(known.circles or ()) == sensed


@pytest.mark.parametrize("seed", range(8))
def test_the_oracle_s_own_formula_follows_the_same_motion(seed: int) -> None:
    rng = np.random.default_rng(200 + seed)
    walls = Walls(lower_m=(0.5, 0.5), upper_m=(10.0, 10.0)) if seed % 2 else None
    world = scenario(*random_obstacles(rng, 15), walls=walls)
    segments = uniform_segments(world, 12.0)
    for index, obstacle in enumerate(world.obstacles):
        own = segments.select([index])
        rows = list(zip(*(column.tolist() for column in own)))
        for row, piece in zip(rows, checked_pieces(obstacle, walls, 12.0), strict=True):
            assert row[:6] == pytest.approx(piece, abs=1e-9)
        for before, after in pairwise(rows):
            assert before[1] == pytest.approx(after[0])


def test_the_oracle_does_not_wait_for_what_has_vanished() -> None:
    blocking = Obstacle(center_m=(4.0, 0.0), radius_m=2.0)
    straight = solve(scenario(replace(blocking, vanishes_s=0.5)), 1.0)
    assert (straight.certificate, straight.length_m) == (Certificate.FEASIBLE, 9.0)
    around = solve(scenario(blocking), 1.0)
    assert around.length_m > 10.0
    # It gives way after 3 s: a path longer than the straight one, shorter than the one around.
    for gone in (replace(blocking, vanishes_s=3.0), _leaving(blocking, 3.0)):
        found = solve(scenario(gone), 1.0)
        assert found.certificate is Certificate.FEASIBLE
        assert 9.1 < found.length_m < around.length_m - 0.2


def _leaving(obstacle: Obstacle, end_s: float) -> Obstacle:
    """One that is recorded until then only."""
    x, y = obstacle.center_m
    return replace(obstacle, trajectory=((0.0, x, y), (end_s, x, y)))


def test_a_goal_that_is_covered_for_a_while_only_can_be_reached() -> None:
    covering = Obstacle(center_m=(9.0, 0.0), radius_m=1.0)
    for end, certificate in ((11.0, Certificate.FEASIBLE), (None, Certificate.INFEASIBLE)):
        world = scenario(replace(covering, vanishes_s=end), time_limit_s=14.0)
        assert solve(world, 1.0).certificate is certificate
    late = scenario(replace(covering, appears_s=9.5), time_limit_s=14.0)
    assert solve(late, 1.0).length_m == 9.0


def test_a_run_meets_them_only_while_they_are_there() -> None:
    params = PlannerParams(speed_mps=1.0)
    stands = Obstacle(center_m=(4.5, 0.0), radius_m=0.3)
    for begin, end, hits in ((0.0, None, 1), (0.0, 3.0, 0), (6.0, None, 0), (4.4, 4.5, 1)):
        world = scenario(replace(stands, appears_s=begin, vanishes_s=end))
        episode = run(world, planner=params, path_planner=Straight(params, SensorParams(), 0))
        result = evaluate(episode)
        assert result.collisions == hits
        sensed = {n for tick in episode.ticks for n in within_range(episode, tick)}
        assert sensed == set(result.encounters)


def test_the_start_may_be_where_somebody_comes_later() -> None:
    there = Obstacle(center_m=(0.0, 0.1), radius_m=0.3)
    scenario(replace(there, appears_s=5.0))
    with pytest.raises(ConfigError, match="inside obstacle 1"):
        scenario(there)
    walking = ((-1.0, 0.0, -1.0), (1.0, 0.0, 1.0))  # it is at the start at t = 0
    with pytest.raises(ConfigError, match="inside obstacle 1"):
        scenario(Obstacle(center_m=(0.0, -1.0), radius_m=0.3, trajectory=walking))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"trajectory": KNOTS[:1]}, "a single point; give two or more"),
        ({"trajectory": KNOTS[:1] * 2}, "t=1 does not come after 1; sort the points"),
        ({"trajectory": KNOTS[:1] * 20_001}, "20001 points; give at most 20000"),
        ({"trajectory": ()}, "loop: without a trajectory"),
        ({"speed_mps": 1.0}, "with speed_mps or turns as well"),
        ({"stays": True}, "loop: with stays as well"),
        ({"center_m": (0.0, 9.0)}, "not the first point of its trajectory"),
        ({"trajectory": (KNOTS[0], (1.05, 5.0, 0.0))}, "a lap of 0.05 s is shorter than 0.1 s"),
        ({"appears_s": 2.0, "vanishes_s": 2.0}, "vanishes_s=2: not after appears_s=2"),
    ],
)
def test_what_makes_no_sense_is_refused(changes: dict[str, object], reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        scenario(Obstacle(center_m=(9.0, 9.0), radius_m=0.3), recorded(loop=True, **changes))


def test_the_shortest_lap_is_taken_though_its_difference_rounds_down() -> None:
    knots = ((0.2, 5.0, 0.0), (0.3, 5.0, 0.1))
    assert knots[1][0] - knots[0][0] < SHORTEST_LOOP_S
    found = scenario(recorded(loop=True, trajectory=knots, center_m=(5.0, 0.0)))
    assert found.obstacles[0].loop


def test_distances_at_a_knot_are_no_worse_than_rounding() -> None:
    one = recorded(loop=True)
    for number in (1, 7, 1000):
        for t, x, y in KNOTS[:-1]:
            assert distance(center_at(one, t + 3.0 * number), (x, y)) < 1e-9
