# SPDX-License-Identifier: Apache-2.0
"""The oracle among wall segments: known shortest paths, soundness, and its proofs."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point
from mfba_planner.core.segments import Segment, Segments
from mfba_planner.evaluation.oracle import Certificate, Solution, inspect, solve
from mfba_planner.evaluation.oracle.distance_to_go import DistanceToGo
from mfba_planner.evaluation.oracle.infeasibility_proof import unreachable
from mfba_planner.evaluation.oracle.lattice_search import LatticeParams, lattice_paths
from mfba_planner.evaluation.oracle.path_check import wall_clearance
from mfba_planner.evaluation.oracle.solution import Waypoint
from mfba_planner.evaluation.oracle.static_walls import StaticWalls
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.constant_velocity_segments import uniform_segments
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.wall_contact import wall_clearances

V = 0.8
NUMBERS = st.floats(-3.0, 3.0)
SEGMENTS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
POINTS = st.tuples(NUMBERS, NUMBERS)


def task(*segments: Segment, goal: Point = (6.0, 0.0)) -> Scenario:
    return Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=goal,
        segments_m=segments,
        time_limit_s=60.0,
    )


def box(x0: float, y0: float, x1: float, y1: float) -> tuple[Segment, ...]:
    return ((x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0))


def clearance(world: Scenario, found: Solution) -> float:
    """By the formula of the simulation."""
    points = np.array([w.point for w in found.waypoints]).T
    times = np.diff([w.t_s for w in found.waypoints])
    return float(wall_clearances(world.segments, 0.3, times, points).gap_m.min())


# --- known shortest paths ---------------------------------------------------------------------


def round_one_end(along: float, aside: float) -> float:
    """Half the shortest path past a wall across, whose end is (along, aside) from the start."""
    d = math.hypot(along, aside)
    return math.sqrt(d * d - 0.09) + 0.3 * (math.atan2(aside, along) + math.asin(0.3 / d))


def test_a_wall_across_is_passed_round_its_nearer_end() -> None:
    world = task((3.0, -1.0, 3.0, 4.0))
    found = solve(world, V)
    exact = 2.0 * round_one_end(3.0, 1.0)
    assert exact <= found.length_m <= exact + 1e-3
    assert found.certificate is Certificate.FEASIBLE
    assert min(w.y for w in found.waypoints) < -1.2
    assert clearance(world, found) == pytest.approx(found.clearance_m, abs=1e-9)
    assert found.clearance_m >= 0.0


def test_a_door_is_passed_and_no_door_is_not() -> None:
    """0.7 m for a robot of 0.6 m, aslant; the shorter way is through it, or round without it."""
    walls = ((3.0, -9.0, 3.0, 1.0), (3.0, 1.7, 3.0, 5.0))
    found = solve(task(*walls, goal=(6.0, 3.0)), V)
    assert found.straight_m < found.length_m < 6.72
    round_it = solve(task((3.0, -9.0, 3.0, 5.0), goal=(6.0, 3.0)), V)
    assert round_it.length_m > 9.0
    assert clearance(task(*walls), found) >= 0.0


def test_out_of_a_u() -> None:
    """Back to its open end, along the arm and round its corner: straight pieces and arcs."""
    u = ((2.0, -1.0, 2.0, 1.0), (-1.0, 1.0, 2.0, 1.0), (-1.0, -1.0, 2.0, -1.0))
    found = solve(task(*u), V)
    into = math.sqrt(2.0 - 0.09) + 0.3 * (math.pi / 4.0 + math.asin(0.3 / math.sqrt(2.0)))
    out = math.sqrt(17.0 - 0.09) + 0.3 * (math.atan2(1.0, 4.0) + math.asin(0.3 / math.sqrt(17.0)))
    exact = into + 0.3 * math.pi / 2.0 + 3.0 + out
    assert exact - 1e-6 <= found.length_m <= exact + 0.01
    assert clearance(task(*u), found) >= 0.0


def test_a_moving_obstacle_in_a_door_is_waited_for_or_passed() -> None:
    world = load_scenario("rooms")
    found = solve(world, V)
    assert found.certificate is Certificate.FEASIBLE
    still = solve(replace(world, obstacles=()), V)
    assert still.length_m <= found.length_m < 1.1 * still.length_m
    assert clearance(world, found) >= 0.0
    assert inspect(world, found.waypoints, V)[1] == ""


def test_a_straight_line_beside_a_wall_is_a_straight_line() -> None:
    found = solve(task((2.0, 0.31, 4.0, 0.31)), V)
    assert [w.point for w in found.waypoints] == [(0.0, 0.0), (6.0, 0.0)]
    assert found.clearance_m == pytest.approx(0.01)


# --- soundness --------------------------------------------------------------------------------


@pytest.mark.no_cover
@settings(max_examples=30)
@given(segments=st.lists(SEGMENTS, max_size=6), moving=st.booleans())
def test_trajectories_touch_no_wall(segments: list[Segment], moving: bool) -> None:
    """And the estimate of the distance is not above any of them, and no proof contradicts."""
    ends = Segments.of([s for s in segments if s[:2] != s[2:]])
    near = [ends.distances(x, 0.0).min(initial=9.0) for x in (-4.0, 4.0)]
    assume(min(near) > 0.4)
    walker = Obstacle(center_m=(0.0, -3.0), radius_m=0.3, speed_mps=0.4, heading_rad=1.5)
    world = Scenario(
        name="x", start_m=(-4.0, 0.0), goal_m=(4.0, 0.0), time_limit_s=40.0,
        segments_m=tuple(s for s in segments if s[:2] != s[2:]),
        obstacles=(walker,) if moving else (),
    )  # fmt: skip
    found = solve(world, V)
    if found.certificate is not Certificate.FEASIBLE:
        return
    assert inspect(world, found.waypoints, V)[1] == ""
    if world.segments_m:
        assert clearance(world, found) >= -1e-9
    to_go = DistanceToGo(world)(np.array([-4.0]), np.array([0.0]))[0]
    assert to_go <= found.length_m + 1e-9
    assert unreachable(world, V, uniform_segments(world, 40.0)) == ""


@given(segment=SEGMENTS, points=st.lists(POINTS, min_size=2, max_size=5))
def test_the_independent_check_agrees_with_the_simulation(
    segment: Segment, points: list[Point]
) -> None:
    assume(math.dist(segment[:2], segment[2:]) > 1e-6)
    world = Scenario(name="x", start_m=(90.0, 0.0), goal_m=(91.0, 0.0), segments_m=(segment,))
    waypoints = [Waypoint(float(k), *point) for k, point in enumerate(points)]
    simulated = wall_clearances(
        world.segments, 0.3, np.ones(len(points) - 1), np.array(points).T
    ).gap_m.min()
    assert wall_clearance(world, waypoints) == pytest.approx(simulated, abs=1e-7)


def test_the_check_names_the_wall() -> None:
    world = task((3.0, -1.0, 3.0, 1.0))
    through = [Waypoint(0.0, 0.0, 0.0), Waypoint(6.0 / V, 6.0, 0.0)]
    assert inspect(world, through, V) == (-0.3, "touches a wall (0.3 m inside)")


@given(
    segments=st.lists(SEGMENTS, min_size=1, max_size=5),
    points=st.lists(POINTS, min_size=1, max_size=20),
)
def test_steps_of_the_lattice_are_tested_as_edges(
    segments: list[Segment], points: list[Point]
) -> None:
    walls = StaticWalls(Segments.of(segments), 0.3)
    angles = np.arange(8) * math.tau / 8.0
    steps, start = 0.4 * np.stack([np.cos(angles), np.sin(angles)], axis=1), np.array(points)
    which = np.arange(len(points) * 8)[::3]
    expected = walls.clear(start[which // 8], steps[which % 8], 1e-5)
    assert walls.clear_steps(start, steps, which, 1e-5).tolist() == expected.tolist()


def test_the_lattice_goes_round_walls() -> None:
    world = task((3.0, -1.0, 3.0, 1.5))
    params = LatticeParams()
    moving = uniform_segments(world, 20.0)
    walls = StaticWalls.of(world)
    paths = lattice_paths(world.start_m, world.goal_m, V, moving, 20.0, params, None, walls)
    assert paths
    for path in paths:
        assert walls.clear_path(path)
        for a, b in pairwise(path):
            assert not (a[0] < 3.0 < b[0] and abs(a[1]) < 1.0 and abs(b[1]) < 1.0)


# --- proofs -----------------------------------------------------------------------------------


@pytest.mark.parametrize("walls", [box(5.0, -1.0, 7.0, 1.0), box(-1.0, -1.0, 1.0, 1.0)])
def test_an_enclosed_goal_or_start_is_proven(walls: tuple[Segment, ...]) -> None:
    found = solve(task(*walls), V)
    assert found.certificate is Certificate.INFEASIBLE
    assert found.reason == "walls enclose the start or goal_m"


def test_a_gap_of_less_than_the_robot_is_none_and_a_wider_one_is() -> None:
    """On either side of the robot's 0.6 m, by what the grid of the proof cannot tell."""
    for gap, certificate in ((0.45, Certificate.INFEASIBLE), (0.7, Certificate.FEASIBLE)):
        bottom, right, top, left = box(5.0, -1.0, 7.0, 1.0)
        world = task(bottom, right, top, (5.0, 1.0, 5.0, gap / 2.0), (5.0, -1.0, 5.0, -gap / 2.0))
        assert solve(world, V).certificate is certificate
        assert left[0] == 5.0


def test_no_proof_from_walls_that_end_somewhere() -> None:
    world = task((5.0, -30.0, 5.0, 30.0))
    assert unreachable(world, V, uniform_segments(world, 60.0)) == ""
