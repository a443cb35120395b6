# SPDX-License-Identifier: Apache-2.0
"""Contacts, clearances and smoothness: worked examples, and independence of the block size."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trip_samples import SECOND, post, trip

from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation import metrics
from mfba_planner.evaluation.metrics import MetricsAccumulator, assess, evaluate, run_motion
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario


def mover(center: tuple[float, float], degrees: float, speed: float = 1.0) -> Obstacle:
    return Obstacle(
        center_m=center, radius_m=0.5, speed_mps=speed, heading_rad=math.radians(degrees)
    )


def test_a_moving_robot_hits_a_post() -> None:
    # enlarged radius 0.8: contact between x = 1 and x = 2
    found = run_motion(trip([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], obstacles=(post((2.0, 0.0)),)))
    assert (found.hits_moving, found.hits_standing) == (1, 0)
    assert (found.first_contact_with, found.first_contact_s) == (1, 1.0)


def test_an_obstacle_hits_a_standing_robot() -> None:
    # 3.8 m away at 1 m/s: contact after 3 s
    far, near = post((9.0, 5.0)), mover((3.8, 0.0), 180.0)
    found = run_motion(trip([(0.0, 0.0)] * 6, obstacles=(far, near)))
    assert (found.hits_moving, found.hits_standing) == (0, 1)
    assert (found.first_contact_with, found.first_contact_s) == (2, 3.0)


def test_hits_of_both_kinds_are_all_collisions() -> None:
    points = [(0.0, 0.0), (1.5, 0.0), (1.5, 0.0), (1.5, 0.0), (1.5, 0.0)]
    obstacles = (post((1.9, 0.0)), mover((1.5, 3.5), -90.0))
    episode = trip(points, obstacles=obstacles)
    found = run_motion(episode)
    assert (found.hits_moving, found.hits_standing) == (1, 1)
    assert evaluate(episode).collisions == 2
    assert (found.first_contact_with, found.first_contact_s) == (1, 0.0)


def test_no_first_contact_without_contact() -> None:
    found = run_motion(trip([(0.0, 0.0), (1.0, 0.0)], obstacles=(post((0.0, 5.0)),)))
    assert (found.first_contact_with, found.first_contact_s) == (0, math.inf)


def test_mean_clearance_is_to_the_nearest_obstacle_of_each_step() -> None:
    # nearest during the steps: 2.2 (at x = 1, post 3 m off the end) and 1.2 m
    episode = trip([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], obstacles=(post((4.0, 0.0)),))
    found = run_motion(episode)
    assert found.mean_clearance_m == pytest.approx((2.2 + 1.2) / 2)
    assert evaluate(episode).min_clearance_m == pytest.approx(1.2)
    with_second_post = replace(
        episode,
        scenario=replace(
            episode.scenario, obstacles=(*episode.scenario.obstacles, post((0.0, 1.0)))
        ),
    )
    assert run_motion(with_second_post).mean_clearance_m == pytest.approx(
        (0.2 + math.sqrt(2.0) - 0.8) / 2
    )


def test_time_to_collision_at_the_velocities_of_the_step() -> None:
    # 5 m apart, closing at 1 + 0.5 m/s, 0.8 m between centres in contact
    head_on = trip([(0.0, 0.0), (1.0, 0.0)], obstacles=(mover((5.0, 0.0), 180.0, 0.5),))
    assert run_motion(head_on).min_ttc_s == pytest.approx(4.2 / 1.5)
    overtaken = trip([(0.0, 0.0), (1.0, 0.0)], obstacles=(mover((-2.0, 0.0), 0.0, 3.0),))
    assert run_motion(overtaken).min_ttc_s == pytest.approx(1.2 / 2.0)
    passing = trip([(0.0, 0.0), (1.0, 0.0)], obstacles=(post((5.0, 0.81)),))
    assert run_motion(passing).min_ttc_s == math.inf
    leaving = trip([(0.0, 0.0), (-1.0, 0.0)], obstacles=(post((5.0, 0.0)),))
    assert run_motion(leaving).min_ttc_s == math.inf
    inside = trip([(0.0, 0.0), (0.0, 1.0)], obstacles=(post((0.5, 0.0)),))
    assert run_motion(inside).min_ttc_s == 0.0


def test_a_path_with_corners() -> None:
    # east, north (90), on, then north-west (45), then 10 degrees more
    h = math.radians(145.0)
    points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 1.0), (1.0, 2.0)]
    points += [(1.0 - math.sqrt(0.5), 2.0 + math.sqrt(0.5))]
    x, y = points[-1]
    points.append((x + math.cos(h), y + math.sin(h)))
    found = run_motion(trip(points))
    assert math.degrees(found.turning_rad) == pytest.approx(90.0 + 45.0 + 10.0)
    assert found.heading_changes == 2, "ten degrees are no change, standing still is none"
    assert found.curvature_radpm == pytest.approx(math.radians(145.0) / 5.0)


def test_turns_are_at_most_180_degrees() -> None:
    a, b = math.radians(170.0), math.radians(-170.0)
    points = [(0.0, 0.0), (math.cos(a), math.sin(a))]
    points.append((points[1][0] + math.cos(b), points[1][1] + math.sin(b)))
    assert math.degrees(run_motion(trip(points)).turning_rad) == pytest.approx(20.0)


def test_jerk_is_the_third_difference() -> None:
    # x = t^3 / 6 has jerk 1 m/s^3 everywhere
    points = [(k**3 / 6.0, 0.0) for k in range(8)]
    assert run_motion(trip(points)).jerk_mps3 == pytest.approx(1.0)
    half = replace(SECOND, speed_mps=2.0)  # half a second per tick: eight times as much
    assert run_motion(trip(points, planner=half)).jerk_mps3 == pytest.approx(8.0)
    assert run_motion(trip(points[:3])).jerk_mps3 == 0.0
    # (1, 0) and (0, 1) in turn: |p3 - 3 p2 + 3 p1 - p0| of a square's corners
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    assert run_motion(trip(square)).jerk_mps3 == pytest.approx(2.0)


def test_time_in_obstacle_avoidance() -> None:
    modes = [Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE, Mode.OBSTACLE_AVOIDANCE]
    assert run_motion(trip([(0.0, 0.0)] * 3, modes)).avoidance_s == 2.0


@pytest.mark.parametrize("count", [0, 1])
def test_a_run_without_a_step(count: int) -> None:
    found = run_motion(trip([(1.0, 2.0)] * count, obstacles=(post((1.0, 5.0)),)))
    assert found.mean_clearance_m == (pytest.approx(2.2) if count else math.inf)
    assert (found.turning_rad, found.curvature_radpm, found.jerk_mps3) == (0.0, 0.0, 0.0)
    assert (found.hits_moving, found.min_ttc_s) == (0, math.inf)


@pytest.mark.parametrize("block", [2, 3, 7, 64])
def test_the_block_size_changes_nothing(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    episode = run(load_scenario("case2"), planner=PlannerParams(speed_mps=0.5), seed=3)
    result, whole = assess(episode)
    monkeypatch.setattr(metrics, "BLOCK", block)
    again, cut = assess(episode)
    assert again == result
    for name in whole.__slots__:
        assert getattr(cut, name) == pytest.approx(getattr(whole, name), rel=1e-12), name


def test_a_contact_across_blocks_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    episode = trip([(0.1 * k, 0.0) for k in range(40)], obstacles=(post((2.0, 0.0)),))
    for block in range(2, 41):
        monkeypatch.setattr(metrics, "BLOCK", block)
        assert evaluate(episode).collisions == 1, block


def test_figures_of_the_ticks_so_far() -> None:
    episode = run(load_scenario("case1"), seed=1)
    accumulator = MetricsAccumulator(episode)
    for k, tick in enumerate(episode.ticks):
        accumulator.add(tick)
        if k in (0, 1, 17):
            prefix = replace(episode, ticks=episode.ticks[: k + 1])
            assert accumulator.result(episode.outcome) == evaluate(prefix)
    assert accumulator.result(episode.outcome) == evaluate(episode)
    assert accumulator.run_motion().turning_rad == run_motion(episode).turning_rad


POINTS = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


@settings(max_examples=50)
@given(points=st.lists(POINTS, min_size=2, max_size=8), far=st.floats(10.0, 20.0))
def test_rotation_and_translation_change_nothing(
    points: list[tuple[float, float]], far: float
) -> None:
    def turned(episode: Any) -> Episode:
        def rotate(p: tuple[float, float]) -> tuple[float, float]:
            return (far - p[1], p[0])

        obstacles = tuple(
            replace(o, center_m=rotate(o.center_m), heading_rad=o.heading_rad + math.pi / 2)
            for o in episode.scenario.obstacles
        )
        return trip([rotate(p) for p in points], obstacles=obstacles)

    episode = trip(points, obstacles=(mover((4.0, 0.5), 170.0, 0.7), post((0.0, 6.0))))
    a, b = run_motion(episode), run_motion(turned(episode))
    assert a.mean_clearance_m == pytest.approx(b.mean_clearance_m, abs=1e-9)
    assert a.jerk_mps3 == pytest.approx(b.jerk_mps3, abs=1e-9)
    assert a.hits_moving + a.hits_standing == evaluate(episode).collisions
    assert evaluate(episode).min_clearance_m <= a.mean_clearance_m + 1e-12


def test_a_pose_that_is_not_finite_has_no_gap() -> None:
    episode = trip([(0.0, 0.0), (math.nan, 0.0), (1.0, 0.0)], obstacles=(post((3.0, 0.0)),))
    result, found = assess(episode)
    assert result.min_clearance_m == math.inf
    assert found.hits_moving == 0


def test_no_obstacles_no_contact() -> None:
    scenario = Scenario(name="x", start_m=(0.0, 0.0), goal_m=(1.0, 0.0))
    found = run_motion(run(scenario, seed=1))
    assert (found.mean_clearance_m, found.min_ttc_s) == (math.inf, math.inf)
