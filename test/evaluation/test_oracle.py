# SPDX-License-Identifier: Apache-2.0
"""The oracle: free by two independent formulas, no planner is shorter, and its proofs."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.oracle import Certificate, Solution, inspect, solve
from mfba_planner.evaluation.oracle.infeasibility_proof import ReachParams, unreachable
from mfba_planner.evaluation.oracle.lattice_search import (
    LatticeParams,
    _free,
    _free_steps,
    lattice_paths,
)
from mfba_planner.evaluation.oracle.path_check import clearance, pieces
from mfba_planner.evaluation.oracle.path_refinement import refine
from mfba_planner.evaluation.oracle.polyline import FAR_M, gaps, lengths, pair_gaps, path_gaps
from mfba_planner.evaluation.oracle.solution import Waypoint
from mfba_planner.evaluation.oracle.tangent_search import SearchParams
from mfba_planner.evaluation.suites import suite
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.constant_velocity_segments import uniform_segments
from mfba_planner.simulation.contact import step_clearances
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn, Walls, center_at
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

ROOM = Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0))
V = 0.8
STRAIGHT_M = 12.0 * math.sqrt(2.0)

POINTS = st.tuples(st.floats(1.0, 11.0), st.floats(1.0, 11.0))
TURNS = st.lists(
    st.tuples(st.floats(0.1, 25.0), st.floats(0.0, 2.0), st.floats(-4.0, 4.0)),
    max_size=5,
    unique_by=lambda row: row[0],
).map(lambda rows: tuple(Turn(at_s=t, speed_mps=v, heading_rad=h) for t, v, h in sorted(rows)))
MOTIONS = st.builds(
    Obstacle,
    center_m=POINTS,
    radius_m=st.floats(0.05, 0.9),
    speed_mps=st.floats(0.0, 2.0),
    heading_rad=st.floats(-4.0, 4.0),
    turns=TURNS,
)


def task(*obstacles: Obstacle, walls: Walls | None = None, limit_s: float = 120.0) -> Scenario:
    return Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=(12.0, 12.0),
        obstacles=obstacles,
        walls=walls,
        time_limit_s=limit_s,
    )


def post(x: float, y: float, radius: float = 0.3) -> Obstacle:
    return Obstacle(center_m=(x, y), radius_m=radius)


def ring(center: Point, radius: float, inwards_mps: float = 0.0) -> tuple[Obstacle, ...]:
    """Twelve obstacles without a gap for the robot."""
    angles = [k * math.tau / 12.0 for k in range(12)]
    return tuple(
        Obstacle(
            center_m=(center[0] + radius * math.cos(a), center[1] + radius * math.sin(a)),
            radius_m=0.3,
            speed_mps=inwards_mps,
            heading_rad=a + math.pi,
        )
        for a in angles
    )


def timed(points: list[Point], speed: float) -> list[Waypoint]:
    t, waypoints = 0.0, [Waypoint(0.0, *points[0])]
    for a, b in pairwise(points):
        t += math.dist(a, b) / speed
        waypoints.append(Waypoint(t, *b))
    return waypoints


def core_clearance(world: Scenario, waypoints: list[Waypoint]) -> float:
    return min(
        min(step_clearances(world, a.t_s, b.t_s, a.point, b.point), default=math.inf)
        for a, b in pairwise(waypoints)
    )


def assert_sound(world: Scenario, found: Solution, speed: float) -> None:
    """Check a trajectory without the oracle's own check."""
    path = list(found.waypoints)
    assert (path[0], path[-1].point) == ((0.0, *world.start_m), world.goal_m)
    for a, b in pairwise(path):
        assert math.dist(a.point, b.point) == pytest.approx(speed * (b.t_s - a.t_s), abs=1e-9)
    assert core_clearance(world, path) >= -1e-9
    assert found.length_m == pytest.approx(sum(math.dist(a[1:], b[1:]) for a, b in pairwise(path)))
    assert found.length_m >= found.straight_m - 1e-9
    assert found.detour == found.length_m / found.straight_m


# --- figures to hold --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "speed", "at_most_m"),
    [
        ("case1", 0.8, 16.97057),
        ("case1", 0.5, 16.9861),
        ("case2", 0.8, 16.9985),
        ("case2", 0.5, 17.0228),
        ("walled", 0.8, 14.14214),
    ],
)
def test_optimum_of_the_shipped_scenarios(case: str, speed: float, at_most_m: float) -> None:
    found = solve(load_scenario(case), speed)
    assert found.certificate is Certificate.FEASIBLE
    assert at_most_m - 0.0005 <= found.length_m <= at_most_m
    assert_sound(load_scenario(case), found, speed)


def test_an_empty_world_is_a_straight_line() -> None:
    found = solve(task(), V)
    assert [w.point for w in found.waypoints] == [(0.0, 0.0), (12.0, 12.0)]
    assert found.length_m == pytest.approx(STRAIGHT_M, abs=1e-12)
    assert found.clearance_m == math.inf


def test_a_post_on_the_straight_line_is_passed_on_tangents_and_an_arc() -> None:
    # two tangents of length sqrt(half^2 - 0.6^2) and the arc between them
    half = STRAIGHT_M / 2.0
    lean = math.asin(0.6 / half)
    exact = 2.0 * math.sqrt(half**2 - 0.36) + 0.6 * 2.0 * lean
    found = solve(task(post(6.0, 6.0)), V)
    assert exact <= found.length_m <= exact + 2e-3


def test_a_big_post_is_passed_on_an_arc_of_many_chords() -> None:
    half = STRAIGHT_M / 2.0
    exact = 2.0 * math.sqrt(half**2 - 9.0) + 3.0 * 2.0 * math.asin(3.0 / half)
    found = solve(task(post(6.0, 6.0, radius=2.7)), V)
    assert exact <= found.length_m <= exact * 1.001


def test_the_shorter_side_is_taken() -> None:
    for shift in (0.2, -0.2):
        found = solve(task(post(6.0 + shift, 6.0 - shift)), V)
        via = found.waypoints[1]
        assert (via.y - via.x) * shift > 0.0


def test_a_covered_goal_is_reached_later_by_a_longer_path() -> None:
    leaving = Obstacle(center_m=(12.0, 11.9), radius_m=0.3, speed_mps=0.02)
    world = task(leaving)
    found = solve(world, V)
    freed_s = math.sqrt(0.36 - 0.01) / 0.02
    assert freed_s <= found.waypoints[-1].t_s <= freed_s + 0.05
    assert_sound(world, found, V)


# --- soundness --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["random-10", "random-30", "adversarial", "turning", "fast-20", "pedestrians"]
)
def test_trajectories_are_free_by_the_simulation_s_formula_too(name: str) -> None:
    for k in range(6):
        world = suite(name).world(k, V)
        found = solve(world, V)
        assert found.certificate is Certificate.FEASIBLE
        assert_sound(world, found, V)
        assert found.clearance_m == pytest.approx(
            core_clearance(world, list(found.waypoints)), abs=1e-9
        )


@settings(max_examples=25)
@given(st.lists(MOTIONS, max_size=5), st.booleans())
def test_trajectories_through_random_motions(obstacles: list[Obstacle], closed: bool) -> None:
    assume(all(math.hypot(*o.center_m) > o.radius_m + 0.3 for o in obstacles))
    world = task(*obstacles, walls=ROOM if closed else None, limit_s=40.0)
    found = solve(world, V)
    if found.certificate is Certificate.FEASIBLE:
        assert_sound(world, found, V)
    else:
        assert (found.length_m, found.waypoints) == (math.inf, ())
        assert found.reason


@settings(max_examples=200)
@given(
    MOTIONS,
    st.booleans(),
    st.lists(POINTS, min_size=2, max_size=6, unique=True),
    st.floats(0.3, 3.0),
)
def test_three_formulas_of_clearance_agree(
    obstacle: Obstacle, closed: bool, points: list[Point], speed: float
) -> None:
    world = Scenario(
        name="x",
        start_m=(99.0, 99.0),
        goal_m=(98.0, 99.0),
        obstacles=(obstacle,),
        walls=ROOM if closed else None,
    )
    assume(all(math.dist(a, b) > 1e-3 for a, b in pairwise(points)))
    path = timed(points, speed)
    ours = core_clearance(world, path)
    assert clearance(world, path) == pytest.approx(ours, abs=1e-6)
    segments = uniform_segments(world, path[-1].t_s + 1.0)
    many = gaps(np.array([points, points[::-1]]), speed, segments)
    back = core_clearance(world, timed(points[::-1], speed))
    for found, core in zip(many, (ours, back)):
        assert min(found.min(), FAR_M) == pytest.approx(min(core, FAR_M), abs=1e-6)


@settings(max_examples=100)
@given(MOTIONS, st.booleans(), st.floats(0.5, 60.0))
def test_motion_by_events_equals_center_at(obstacle: Obstacle, closed: bool, until: float) -> None:
    walls = ROOM if closed else None
    end = 0.0
    for start, stop, x, y, vx, vy in pieces(obstacle, walls, until):
        assert start == pytest.approx(end, abs=1e-9)
        middle = (start + stop) / 2.0
        position = (x + vx * (middle - start), y + vy * (middle - start))
        assert position == pytest.approx(center_at(obstacle, middle, walls), abs=1e-6)
        end = stop
    assert end == pytest.approx(until, abs=1e-9)


def test_what_the_independent_check_refuses() -> None:
    world = task(post(6.0, 6.0), limit_s=100.0)
    path = timed([(0.0, 0.0), (7.0, 5.0), (12.0, 12.0)], V)
    assert inspect(world, path, V)[1] == ""
    assert "does not start at start_m at t = 0" in inspect(world, path[1:], V)[1]
    assert "end at goal_m" in inspect(world, path[:-1], V)[1]
    assert "in" in inspect(world, path, 0.9)[1]
    assert "moves" in inspect(world, path, 0.9)[1]
    smallest, fault = inspect(world, timed([(0.0, 0.0), (12.0, 12.0)], V), V)
    assert smallest == pytest.approx(-0.6)
    assert fault == "touches an enlarged circle (0.6 m inside)"
    slow = timed([(0.0, 0.0), (7.0, 5.0), (12.0, 12.0)], 0.1)
    assert "ends after the time limit of 100 s" in inspect(world, slow, 0.1)[1]


# --- none is shorter --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["paper", "random-3", "random-10", "random-20"])
def test_the_paper_s_planner_is_never_earlier(name: str) -> None:
    params = PlannerParams(speed_mps=V)
    compared = 0
    for k in range(8):
        world = suite(name).world(k, V)
        result = evaluate(run(world, planner=params, seed=k))
        if result.outcome is Outcome.GOAL_REACHED and result.collisions == 0:
            best = solve(world, V)
            assert best.length_m <= V * result.time_s + params.goal_tolerance_m
            compared += 1
    assert compared >= 6


@pytest.mark.parametrize(("name", "k"), [("random-10", 1), ("random-20", 2), ("adversarial", 3)])
def test_the_lattice_search_finds_nothing_shorter(name: str, k: int) -> None:
    world = suite(name).world(k, V)
    best = solve(world, V)
    limit_s = 1.012 * best.length_m / V
    segments = uniform_segments(world, limit_s + 1.0)
    params = LatticeParams(step_s=0.6, headings=64, cell_m=0.1, max_paths=12)
    paths = lattice_paths(world.start_m, world.goal_m, V, segments, limit_s, params)
    refined = [path for rough in paths if (path := refine(rough, V, segments)) is not None]
    assert refined
    shortest = min(float(lengths(path[None])[0]) for path in refined)
    assert best.length_m <= shortest + 2e-3


def test_a_finer_search_gains_next_to_nothing() -> None:
    fine = SearchParams(chord_rad=math.radians(6.0), bin_s=0.03, slack_s=0.15, max_paths=30)
    for k in range(5):
        world = suite("random-20").world(k, V)
        assert solve(world, V).length_m <= solve(world, V, fine).length_m + 2e-3


# --- no path ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("world", "reason"),
    [
        (
            task(*ring((12.0, 12.0), 1.5), limit_s=40.0),
            "goal_m cannot be reached within the time limit of 40 s",
        ),
        (
            task(post(12.0, 11.9), limit_s=30.0),
            "goal_m cannot be reached within the time limit of 30 s",
        ),
        (task(*ring((0.0, 0.0), 1.2, 0.1)), "contact cannot be avoided beyond t = "),
        (task(limit_s=20.0), "the straight path alone takes 21.2132 s of 20 s"),
    ],
    ids=["goal enclosed", "goal covered", "crushed", "too far"],
)
def test_infeasible_worlds_are_proven(world: Scenario, reason: str) -> None:
    found = solve(world, V)
    assert found.certificate is Certificate.INFEASIBLE
    assert found.reason.startswith(reason)
    assert found.length_m == math.inf


def test_a_ring_with_a_gap_is_feasible() -> None:
    world = task(*ring((12.0, 12.0), 1.5)[1:], limit_s=60.0)
    found = solve(world, V)
    assert found.certificate is Certificate.FEASIBLE
    assert_sound(world, found, V)


def test_a_ring_that_opens_later_is_feasible() -> None:
    angles = [k * math.tau / 12.0 for k in range(12)]
    opening = tuple(
        Obstacle(
            center_m=(1.2 * math.cos(a), 1.2 * math.sin(a)),
            radius_m=0.3,
            turns=(Turn(at_s=5.0, speed_mps=0.2, heading_rad=a),),
        )
        for a in angles
    )
    found = solve(task(*opening, limit_s=60.0), V)
    assert found.certificate is Certificate.FEASIBLE
    assert found.detour > 1.2
    assert_sound(task(*opening), found, V)


@pytest.mark.parametrize("name", ["random-30", "adversarial"])
def test_no_infeasibility_proof_for_feasible_worlds(name: str) -> None:
    coarse = ReachParams(cell_m=0.15, step_s=0.3)
    for k in range(5):
        world = suite(name).world(k, V)
        assert solve(world, V).certificate is Certificate.FEASIBLE
        segments = uniform_segments(world, world.time_limit_s)
        assert unreachable(world, V, segments, coarse) == ""


# --- the rest ---------------------------------------------------------------------------------


def test_the_robot_may_be_kept_inside() -> None:
    # the shorter side of the post is outside the room
    wall = Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 2.0))
    world = Scenario(
        name="x",
        start_m=(0.0, 0.1),
        goal_m=(12.0, 0.1),
        obstacles=(post(6.0, 0.5),),
        walls=wall,
    )
    out, kept = solve(world, V), solve(world, V, inside=wall)
    assert min(w.y for w in out.waypoints) < 0.0
    assert all(0.0 <= w.y <= 2.0 for w in kept.waypoints)
    assert kept.length_m > out.length_m
    assert_sound(world, kept, V)


def test_the_same_world_has_the_same_solution() -> None:
    worlds = [suite("random-20").world(k) for k in range(4)]
    first = [solve(world, V) for world in worlds]
    again = [solve(world, V) for world in reversed(worlds)][::-1]
    assert first == again


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_invalid_speeds_are_refused(speed: float) -> None:
    with pytest.raises(ConfigError, match="no speed; give a number above 0"):
        solve(task(), speed)


@pytest.mark.parametrize("speed", [0.15, 0.3, 3.0])
def test_slow_and_fast_robots(speed: float) -> None:
    # slower than some obstacles, as fast as some, faster than all
    world = Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=(12.0, 12.0),
        obstacles=suite("random-10").world(3).obstacles,
        walls=ROOM,
        time_limit_s=300.0,
    )
    found = solve(world, speed)
    assert found.certificate is Certificate.FEASIBLE
    assert_sound(world, found, speed)


def test_pair_gaps_and_path_gaps_equal_gaps_bit_for_bit() -> None:
    rng = np.random.default_rng(5)
    segments = uniform_segments(suite("random-20").world(5), 40.0)
    points = rng.uniform(0.0, 12.0, (6, 9, 2))
    points[2, 4] = points[2, 3]  # an edge of no length
    rows, columns = rng.integers(0, 8, 60), rng.integers(0, segments.t0.size, 60)
    subset = type(segments)(*(values[columns] for values in segments))
    found = pair_gaps(points, V, rows, subset)
    assert np.array_equal(found, gaps(points, V, segments)[:, rows, columns])
    plain = list(zip(*(values.tolist() for values in subset[:7])))
    for path, expected in zip(points, found):
        ends = [(x, y) for x, y in path.tolist()]
        assert path_gaps(ends, V, rows.tolist(), plain) == expected.tolist()


@pytest.mark.parametrize("name", ["random-30", "turning", "dynabarn-like"])
def test_the_lattice_skips_only_segments_out_of_reach(name: str) -> None:
    rng = np.random.default_rng(6)
    segments = uniform_segments(suite(name).world(6), 40.0)
    angles = np.arange(8) * (math.pi / 4.0)
    u = V * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for t in (0.0, 3.1, 17.0):
        position, steps = rng.uniform(0.0, 12.0, (80, 2)), rng.permutation(640)[:500]
        expected = _free(position[steps // 8], u[steps % 8], t, np.full(500, t + 0.6), segments)
        found = _free_steps(position, u, t, t + 0.6, steps, segments)
        assert np.array_equal(found, expected)
        assert 0 < found.sum() < 500
