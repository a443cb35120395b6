# SPDX-License-Identifier: Apache-2.0
"""The way through a known map: shorter than without, in traps, behind walls and to far goals."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from point_maps import polyline

from mfba_planner.core.geometry import Point
from mfba_planner.core.planner_types import Mode
from mfba_planner.core.segments import Segment
from mfba_planner.perception.known_map import KnownMap, UnclearedMap
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.known_route import KnownRoute
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import run, simulate
from mfba_planner.simulation.scenario import Scenario

PARAMS = replace(preset(PlannerParams()), method=Method.PREDICTIVE)
TRAP: tuple[Segment, ...] = (
    (7.0, -3.0, 7.0, 3.0),
    (2.0, 3.0, 7.0, 3.0),
    (2.0, -3.0, 7.0, -3.0),
)
LONG_WALL: tuple[Segment, ...] = ((5.0, -3.0, 5.0, 12.0),)
TWO_WALLS: tuple[Segment, ...] = ((12.0, -15.0, 12.0, 4.0), (24.0, -4.0, 24.0, 20.0))


def place(goal: Point, walls: tuple[Segment, ...]) -> Scenario:
    return Scenario(
        name="place", start_m=(0.0, 0.0), goal_m=goal, robot_radius_m=0.2, segments_m=walls,
        robot=Robot(lidar=Lidar(beams=360, range_max_m=3.5)),
    )  # fmt: skip


@cache
def driven(scenario: Scenario, *, known: bool) -> Episode:
    params = replace(PARAMS, known_map=known)
    return simulate(scenario, planner=params, sensor=SensorParams(), seed=0)


def length_m(episode: Episode) -> float:
    path = np.array([tick.pose.position for tick in episode.ticks])
    return float(np.sqrt((np.diff(path, axis=0) ** 2).sum(axis=1)).sum())


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("goal", "walls", "shortest_m", "saved_m"),
    [
        ((12.0, 0.0), TRAP, 14.3, 7.0),
        ((10.0, 0.0), LONG_WALL, 11.7, 10.0),
        ((32.0, 0.0), TWO_WALLS, 35.4, 1.0),  # a goal that is farther than the local map
    ],
    ids=["trap", "long wall", "far"],
)
def test_the_path_is_near_the_shortest_and_shorter_than_without_the_map(
    goal: Point, walls: tuple[Segment, ...], shortest_m: float, saved_m: float
) -> None:
    scenario = place(goal, walls)
    with_map, without = driven(scenario, known=True), driven(scenario, known=False)
    assert with_map.outcome is without.outcome is Outcome.GOAL_REACHED
    assert shortest_m < length_m(with_map) < 1.06 * shortest_m
    assert length_m(without) - length_m(with_map) > saved_m


def test_the_trap_is_never_entered() -> None:
    for tick in driven(place((12.0, 0.0), TRAP), known=True).ticks:
        x, y = tick.pose.position
        assert not (2.5 < x < 7.0 and abs(y) < 3.0)


@pytest.mark.no_cover
def test_without_known_map_a_map_changes_nothing() -> None:
    """What is given to the planner is what counts, and the scenario's walls only if asked for."""
    scenario = place((12.0, 0.0), TRAP)
    params = scenario.planner_params(PARAMS)
    bare = make_planner(params, SensorParams(), 0)
    bare.set_known_map(None)
    again = run(
        scenario, planner=params, sensor=SensorParams(), path_planner=bare, observe=observe_scan
    )
    assert again.ticks == driven(scenario, known=False).ticks


def test_a_wall_that_is_gone_is_driven_through() -> None:
    """The map is out of date: what the lidar sees through counts no more."""
    scenario = place((10.0, 0.0), ())
    params = scenario.planner_params(PARAMS)
    planner = make_planner(params, SensorParams(), 0)
    planner.set_known_map(KnownMap(np.array(polyline((5.0, -3.0), (5.0, 6.0)))))
    episode = run(
        scenario, planner=params, sensor=SensorParams(), path_planner=planner, observe=observe_scan
    )
    assert episode.outcome is Outcome.GOAL_REACHED
    assert length_m(episode) < 11.5, "round it the way is 11.7 m"
    assert abs(next(t.pose.y for t in episode.ticks if t.pose.x > 5.0)) < 3.0


@pytest.mark.no_cover
def test_a_wall_that_is_not_in_the_map_is_not_touched() -> None:
    scenario = place((10.0, 0.0), LONG_WALL)
    params = scenario.planner_params(PARAMS)
    planner = make_planner(params, SensorParams(), 0)
    planner.set_known_map(KnownMap(np.array([(20.0, 20.0)])))
    episode = run(
        scenario, planner=params, sensor=SensorParams(), path_planner=planner, observe=observe_scan
    )
    assert episode.outcome is Outcome.GOAL_REACHED
    path = np.array([tick.pose.position for tick in episode.ticks])
    assert scenario.segments.distances(path[:, :1], path[:, 1:]).min() > 0.2


def test_a_goal_that_the_map_closes_off_is_named_with_the_map() -> None:
    scenario = place((6.0, 0.0), ())
    params = scenario.planner_params(PARAMS)
    planner = make_planner(params, SensorParams(), 0)
    corners = [(5.0, -1.0), (7.0, -1.0), (7.0, 1.0), (5.0, 1.0), (5.0, -1.0)]
    planner.set_known_map(KnownMap(np.array(polyline(*corners))))
    episode = run(
        scenario,
        planner=params,
        sensor=SensorParams(),
        path_planner=planner,
        observe=observe_scan,
        go_on=lambda world: world.tick < 30,
    )
    reason = next(t.reason for t in episode.ticks if t.mode is Mode.BLOCKED)
    assert reason.startswith(
        "no way to the goal: closed by what stands around the goal, without a gap as wide as the "
        "robot, by the known map or the lidar"
    )


def route(walls: tuple[Segment, ...]) -> KnownRoute:
    points = [p for x0, y0, x1, y1 in walls for p in polyline((x0, y0), (x1, y1))]
    return KnownRoute(UnclearedMap(KnownMap(np.array(points)), 0.12), 0.2)


def test_the_parts_lead_round_the_walls_to_the_goal() -> None:
    known_route, goal, position = route(TWO_WALLS), (32.0, 0.0), (0.0, 0.0)
    found = [position]
    for _ in range(10):
        position, beyond_m, low, high = known_route.part(0, position, goal, np.empty((0, 2)))
        assert max(high[0] - low[0], high[1] - low[1]) <= 12.0 + 1e-9
        assert all(a <= p <= b for a, p, b in zip(low, position, high))
        found.append(position)
        if position == goal:
            break
        assert beyond_m == pytest.approx(math.dist(position, goal), rel=0.3)
    assert found[-1] == goal
    assert beyond_m == 0.0
    assert sum(map(math.dist, found, found[1:])) < 37.0


def test_it_is_computed_again_for_another_goal_or_where_nothing_gets_nearer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known_route, none = route(LONG_WALL), np.empty((0, 2))
    computed: list[int] = []
    compute = known_route._compute

    def counted(stamp_ns: int, *args: object) -> None:
        computed.append(stamp_ns)
        compute(stamp_ns, *args)  # type: ignore[arg-type]

    monkeypatch.setattr(known_route, "_compute", counted)
    second = 1_000_000_000
    for k in range(9):
        known_route.part(k * second, (0.0, 0.0), (10.0, 0.0), none)
    assert computed == [0]
    known_route.part(9 * second, (0.0, 0.0), (10.0, 1.0), none)
    assert computed == [0, 9 * second]
    for k in range(10, 40):  # 1 m nearer every 5 s
        known_route.part(k * second, (0.0, -0.25 * (k - 9)), (10.0, 1.0), none)
    late = [stamp // second for stamp in computed[2:]]
    assert late, "past the end of the wall it gets no nearer"
    assert min(late) > 20
