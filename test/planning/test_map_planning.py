# SPDX-License-Identifier: Apache-2.0
"""The predictive planner in places: walls, doors, dead ends and people, seen by a lidar alone."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mapped_scenes import wall
from point_maps import PointMap, polyline

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Circle, Decision, Mode, Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.core.segments import Segment
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.perception.scan_to_sectors import aligned
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.perception.static_map import StaticMapParams
from mfba_planner.planning.blocked_headings import PLACE_NS, STANDS_NS
from mfba_planner.planning.differential_drive import Speeds
from mfba_planner.planning.distance_to_go import RouteParams, is_clear
from mfba_planner.planning.map_planning import MapPlanning
from mfba_planner.planning.obstacles_at_rest import STOPPING_TICKS
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import Predictive, preset
from mfba_planner.planning.stopping_path import stopping_path
from mfba_planner.planning.trajectory_cost import RiskParams
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.simulated_lidar import scan_at

RADIUS_M = 0.3
LIDAR = Lidar(beams=360, range_max_m=3.5)
PARAMS = preset(PlannerParams(method=Method.PREDICTIVE, speed_mps=1.0))
COARSE = replace(PARAMS, step_length_m=0.15)  # fewer decisions


def walls(*corners: Point) -> tuple[Segment, ...]:
    return tuple((*a, *b) for a, b in zip(corners, corners[1:]))


START = (0.0, 0.0)
CORRIDOR = walls((-1.0, 1.2), (9.0, 1.2)) + walls((-1.0, -1.2), (9.0, -1.2))
PLACES = {
    "dead end": ((5.0, 0.1), walls((1.5, 0.9), (3.0, 0.9), (3.0, -0.9), (1.5, -0.9))),
    "door": (
        (4.0, 0.5),
        walls((2.0, -2.0), (2.0, -0.35)) + walls((2.0, 0.35), (2.0, 2.0)),
    ),
    "wall": ((3.0, 0.2), walls((1.5, -3.0), (1.5, 3.0))),
    "corridor": (
        (2.0, 3.5),
        walls((-1.0, -0.6), (2.6, -0.6), (2.6, 4.5)) + walls((-1.0, 0.6), (1.4, 0.6), (1.4, 4.5)),
    ),
}


def driven(
    goal: Point,
    segments: tuple[Segment, ...],
    *obstacles: Obstacle,
    drive: Drive = Drive.OMNIDIRECTIONAL,
    seed: int = 0,
    limit_s: float = 40.0,
    params: PlannerParams = COARSE,
) -> Episode:
    scenario = Scenario(
        name="x", start_m=START, goal_m=goal, robot_radius_m=RADIUS_M, segments_m=segments,
        obstacles=obstacles, time_limit_s=limit_s, robot=Robot(lidar=LIDAR, drive=drive),
    )  # fmt: skip
    return simulate(scenario, planner=params, sensor=SensorParams(), seed=seed)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("drive", list(Drive))
@pytest.mark.parametrize("name", PLACES)
def test_the_goal_is_reached_without_contact(name: str, drive: Drive, seed: int) -> None:
    goal, segments = PLACES[name]
    params = PARAMS if name == "door" else COARSE
    result = evaluate(driven(goal, segments, drive=drive, seed=seed, params=params))
    assert (result.outcome, result.collisions) == (Outcome.GOAL_REACHED, 0)
    assert result.min_clearance_m > 0.0


@pytest.mark.parametrize("drive", list(Drive))
def test_between_walls_it_stands_still_and_says_why(drive: Drive) -> None:
    room = walls((-1.2, -1.2), (1.2, -1.2), (1.2, 1.2), (-1.2, 1.2), (-1.2, -1.2))
    episode = driven((4.0, 0.0), room, drive=drive, limit_s=8.0, params=PARAMS)
    assert evaluate(episode).collisions == 0
    for decision in episode.ticks[-10:]:
        assert decision.mode is Mode.BLOCKED
        assert decision.velocity == (0.0, 0.0)
        assert "no way to the goal: closed by what stands around the robot" in decision.reason


@pytest.mark.parametrize("drive", list(Drive))
@pytest.mark.parametrize(
    "person",
    [
        Obstacle(center_m=(3.0, -2.6), radius_m=0.25, speed_mps=0.8, heading_rad=0.5 * math.pi),
        Obstacle(center_m=(7.0, 0.1), radius_m=0.25, speed_mps=0.8, heading_rad=math.pi),
    ],
    ids=["crossing", "oncoming"],
)
def test_a_person_in_a_corridor_is_avoided(person: Obstacle, drive: Drive) -> None:
    result = evaluate(driven((6.0, 0.0), CORRIDOR, person, drive=drive))
    assert (result.outcome, result.collisions) == (Outcome.GOAL_REACHED, 0)


def test_in_the_open_it_decides_as_without_a_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """What moves is not in the map, also where it is met."""
    people = [
        Obstacle(center_m=(3.0, -2.6), radius_m=0.25, speed_mps=0.8, heading_rad=0.5 * math.pi),
        Obstacle(center_m=(4.5, 2.0), radius_m=0.3, speed_mps=0.5, heading_rad=-0.5 * math.pi),
    ]
    with_map = driven((6.0, 0.0), (), *people)
    monkeypatch.setattr(MapPlanning, "move", lambda *_, **__: None)
    without = driven((6.0, 0.0), (), *people)
    assert [d.velocity for d in with_map.ticks] == [d.velocity for d in without.ticks]
    assert any(d.mode is Mode.OBSTACLE_AVOIDANCE for d in with_map.ticks)


def observed(pose: Pose2D, goal: Point, tick: int, *lines: tuple[Point, Point]) -> Observation:
    discs = [disc for line in lines for disc in wall(*line)]
    stamp_ns = (tick + 1) * PARAMS.tick_ns
    scan = aligned(scan_at(pose, LIDAR, discs, None), pose.yaw)
    return Observation(
        stamp_ns=stamp_ns, now_ns=stamp_ns, pose=pose, ranges_m=(), goal=goal, scan=scan
    )


def test_after_a_jump_of_the_odometry_the_map_is_dropped() -> None:
    """The goal lies behind the remembered wall, which is out of view at the new place."""
    planner = Predictive(PARAMS, SensorParams(), 0)
    line, goal = ((2.0, -1.5), (2.0, 1.5)), (8.0, 0.0)
    for tick in range(40):
        decision = planner.plan(observed(Pose2D(0.0, 0.0), goal, tick, line))
    assert "through the map" in decision.reason
    kept = planner.plan(observed(Pose2D(-0.05, 0.0), goal, 40))
    assert "through the map" in kept.reason
    jumped = planner.plan(observed(Pose2D(-6.0, 0.0), goal, 41))
    assert "through the map" not in jumped.reason
    assert jumped.velocity == pytest.approx((1.0, 0.0))


def planning(points: list[Point], drive: Drive = Drive.OMNIDIRECTIONAL) -> MapPlanning:
    params = replace(PARAMS, drive=drive, robot_radius_m=RADIUS_M)
    made = MapPlanning(
        params, StaticMapParams(), RouteParams(), RiskParams(), headings=72, reach_m=2.5,
        search_m=0.3, seed=0,
    )  # fmt: skip
    made.map = PointMap(points)
    return made


def at_start(goal: Point) -> Observation:
    return Observation(
        stamp_ns=1, now_ns=1, pose=Pose2D(0.0, 0.0), ranges_m=(), goal=goal, scan=None
    )


around = st.builds(
    lambda away, angle: (away * math.cos(angle), away * math.sin(angle)),
    st.floats(0.25, 0.6),
    st.floats(-math.pi, math.pi),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(around, min_size=1, max_size=8), st.floats(-3.0, 3.0), st.sampled_from(Drive))
def test_it_never_touches_a_point_of_the_map(
    points: list[Point], angle: float, drive: Drive
) -> None:
    """Until it can have stopped; and what is in contact already is left."""
    goal = (3.0 * math.cos(angle), 3.0 * math.sin(angle))
    made = planning(points, drive)
    tick_s = PARAMS.tick_ns * 1e-9
    move = made.move(at_start(goal), goal, [], Speeds(), None, None, tick_s)
    if move is None:
        assert is_clear(made.map, START, goal, RADIUS_M + 0.05)
        return
    vx, vy = move.velocity
    assert math.hypot(vx, vy) <= PARAMS.speed_mps + 1e-9
    shares = np.linspace(0.0, STOPPING_TICKS * tick_s, 20)
    path = np.stack((shares * vx, shares * vy), axis=1)
    nearer_m = 1e-6
    if drive is Drive.DIFFERENTIAL:
        base = replace(PARAMS, drive=drive)
        path, nearer_m = stopping_path((vx, vy), 3.0, 0.0, Speeds(), base, tick_s), 3e-4
    for x, y in made.map.map_points().tolist():
        away = np.hypot(x - path[:, 0], y - path[:, 1])
        assert away.min() >= min(math.hypot(x, y), RADIUS_M) - nearer_m


@pytest.mark.parametrize(("speed", "kept"), [(0.2, False), (1.0, True)])
def test_a_differential_base_keeps_off_something_slow(speed: float, kept: bool) -> None:
    """It may be the end of a wall; what is faster has left before the base arrives."""
    circle = Circle(center_m=(0.4, 0.0), velocity_mps=(0.0, speed), radius_m=0.3)
    made = planning([], Drive.DIFFERENTIAL)
    _, share = made._kept_off(
        (0.8, 0.0), 3.0, 0.0, Speeds(0.3, 0.0), START, np.empty((0, 2)), [circle], 0.08
    )
    assert (share == 1.0) == kept


def test_only_directions_that_were_observed_are_driven() -> None:
    """A post stands on the way; the headings to one side of it have not been seen."""
    unobserved = np.zeros(72, dtype=bool)
    for side in (1, -1):
        unobserved[:] = False
        unobserved[[(side * k - 1) % 72 for k in range(1, 36)]] = True
        made = planning([(0.8, 0.0), (0.8, 0.04), (0.8, -0.04)])
        move = made.move(at_start((3.0, 0.0)), (3.0, 0.0), [], Speeds(), unobserved, None, 0.08)
        assert move is not None
        assert move.velocity[1] * side < 0.01
        assert math.hypot(*move.velocity) > 0.3


def test_without_points_near_it_leaves_the_decision_to_the_open_planner() -> None:
    for points in ([], [(9.0, 5.0)]):
        goal = (3.0, 0.0)
        assert planning(points).move(at_start(goal), goal, [], Speeds(), None, None, 0.08) is None


@pytest.mark.parametrize("beside_m", [0.1, 0.2])
def test_right_beside_a_wall_the_map_decides(beside_m: float) -> None:
    """The way leads away from it; a turn may still touch it."""
    away_m = RADIUS_M + beside_m
    made = planning([(-away_m, y / 20.0) for y in range(-10, 11)])
    move = made.move(at_start((3.0, 0.0)), (3.0, 0.0), [], Speeds(), None, None, 0.08)
    assert (move is None) == (beside_m > 0.15)


def test_where_the_check_of_the_points_stops_it_it_chooses_another_heading(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The search knows distances on a grid, the check the points: they differ by millimetres."""

    def kept_off(_: MapPlanning, velocity: Point, *__: object) -> tuple[Point, float]:
        ahead = abs(math.atan2(velocity[1], velocity[0])) < 0.3
        return ((0.0, 0.0), 0.0) if ahead else (velocity, 1.0)

    monkeypatch.setattr(MapPlanning, "_kept_off", kept_off)
    made, goal = planning([(1.5, 0.05)]), (3.0, 0.0)
    closed = []
    monkeypatch.setattr(made.search.to_go, "close", lambda *at: closed.append(at))
    found = []
    for tick in range(20):
        obs = replace(at_start(goal), stamp_ns=tick * PARAMS.tick_ns + 1)
        move = made.move(obs, goal, [], Speeds(), None, None, 0.08)
        assert move is not None
        found.append(move.velocity)
    ticks = math.ceil(STANDS_NS / PARAMS.tick_ns)
    assert found[: ticks + 1] == [(0.0, 0.0)] * (ticks + 1)
    assert all(v != (0.0, 0.0) for v in found[ticks + 1 :])
    ((stamp_ns, place),) = closed
    assert stamp_ns == ticks * PARAMS.tick_ns + 1
    assert place == pytest.approx((RADIUS_M + 0.1, 0.0), abs=0.1)


@pytest.mark.parametrize("room_m", [0.05, 0.08, 0.11])
def test_a_differential_base_leads_off_a_wall_beside_which_it_is_slow(room_m: float) -> None:
    """The goal lies along the wall; straight on it would be slow all along."""
    off = RADIUS_M + room_m
    made, goal = planning(polyline((-1.0, off), (8.0, off)), Drive.DIFFERENTIAL), (6.0, 0.0)
    move = made.move(at_start(goal), goal, [], Speeds(), None, None, 0.08)
    assert move is not None
    assert move.waypoint is not None
    assert room_m - move.waypoint[1] > 0.15


@pytest.mark.parametrize(("away_m", "waits"), [(0.9, True), (1.1, False)])
def test_for_an_obstacle_that_moves_in_a_passage_it_waits(
    monkeypatch: pytest.MonkeyPatch, away_m: float, waits: bool
) -> None:
    """So near that the robot may stand still because of him: no passage counts as closed."""
    monkeypatch.setattr(MapPlanning, "_kept_off", lambda *_: ((0.0, 0.0), 0.0))
    made, goal = planning([(1.5, 0.05)]), (3.0, 0.0)
    closed = []
    monkeypatch.setattr(made.search.to_go, "close", lambda *at: closed.append(at))
    person = Circle(center_m=(0.0, 0.5 + away_m), velocity_mps=(0.0, 0.3), radius_m=0.5)
    for tick in range(math.ceil(1.5 * PLACE_NS / PARAMS.tick_ns)):
        pose = Pose2D(-0.5 if tick == 0 else 0.0, 0.0)
        stamp_ns = tick * PARAMS.tick_ns + 1
        obs = replace(at_start(goal), stamp_ns=stamp_ns, pose=pose)
        made.move(obs, goal, [person], Speeds(), None, None, 0.08)
    assert (not closed) == waits


def test_a_place_that_is_not_left_is_gone_round() -> None:
    """Before a post; where the robot then goes is not towards the closed passage."""
    made, goal = planning([(1.5, 0.05)]), (3.0, 0.0)
    found = []
    for tick in range(120):
        pose = Pose2D(-0.5 if tick == 0 else 0.0, 0.0)
        stamp_ns = tick * PARAMS.tick_ns + 1
        obs = replace(at_start(goal), stamp_ns=stamp_ns, pose=pose)
        move = made.move(obs, goal, [], Speeds(), None, None, 0.08)
        assert move is not None
        found.append(math.atan2(move.velocity[1], move.velocity[0]))
    ticks = 2 + math.ceil(PLACE_NS / PARAMS.tick_ns)
    assert all(abs(angle) < 0.5 for angle in found[:ticks])
    assert all(abs(angle - found[ticks - 1]) > 0.8 for angle in found[ticks:])


def reasons(decisions: tuple[Decision, ...]) -> set[str]:
    return {d.reason.split(" is ")[0] for d in decisions}


def test_the_reason_names_the_path_through_the_map() -> None:
    episode = driven(*PLACES["wall"])
    assert "the way through the map" in reasons(episode.ticks)
    first = next(d for d in episode.ticks if "through the map" in d.reason)
    length = float(first.reason.split(" is ")[1].split(" m")[0])
    assert length > 2.0 * math.hypot(1.5, 1.0), "round what has been seen of the wall so far"
