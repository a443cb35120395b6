# SPDX-License-Identifier: Apache-2.0
"""The search for a waypoint, against an evaluation of every candidate by itself."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from point_maps import PointMap, polyline

from mfba_planner.core.geometry import Point
from mfba_planner.core.planner_types import Circle
from mfba_planner.core.random_streams import stream
from mfba_planner.core.robot_base import Base, Drive
from mfba_planner.optimizers.registry import optimize
from mfba_planner.planning.differential_drive import Speeds
from mfba_planner.planning.distance_to_go import RouteParams
from mfba_planner.planning.map_rollout import FORBIDDEN_M, MapRollout
from mfba_planner.planning.map_search import LENGTHS, MARGIN_M, FoundWaypoint, MapSearch
from mfba_planner.planning.trajectory_cost import RiskParams
from mfba_planner.swarm.bat_swarm import BatParams
from mfba_planner.swarm.optimizer import Evaluate, Found
from mfba_planner.swarm.search_region import Disc

RADIUS_M, SPEED, TICK_S, HEADINGS, REACH_M = 0.3, 1.0, 0.1, 72, 2.5
HERE = (0.0, 0.0)
RISK = RiskParams()
BAT = BatParams(population=5, iterations=1)


class Setting:
    """One search from HERE."""

    def __init__(self, known: PointMap, goal: Point, *circles: Circle, base: Base | None = None):
        """circles are what moves, enlarged."""
        self.base = base or Base()
        self.search = MapSearch(RouteParams(), RADIUS_M, HEADINGS, REACH_M)
        self.search.to_go.update(1, known, HERE, goal)
        field = self.search.clearance(known, HERE, 1)
        self.rollout = MapRollout(
            HERE, 0.0, Speeds(), self.base, RADIUS_M, SPEED, TICK_S, self.search.to_go, field,
            circles, RISK.horizon_s,
        )  # fmt: skip
        self.centers: list[Point] = []

    def refine(self, center: Point, evaluate: Evaluate) -> Found:
        self.centers.append(center)
        return optimize("bats", BAT, Disc(0.3, center), stream(0, 1), evaluate)

    def found(
        self, observed: np.ndarray | None = None, last: Point | None = None
    ) -> FoundWaypoint:
        return self.search.search(
            self.rollout, HERE, RISK, SPEED, TICK_S, None, observed, last, self.refine
        )

    def cost(self, waypoint: Point, t1: float) -> float:
        """Eq. 1 with the distance to go, waiting and risk, of one waypoint by itself."""
        qx, qy = np.array([waypoint[0]]), np.array([waypoint[1]])
        length = math.hypot(*waypoint)
        paths = self.rollout.paths(qx, qy, np.array([t1]))
        standing = float(self.rollout.standing_risk(paths, RISK, MARGIN_M)[0])
        moving = float(self.rollout.moving_risk(paths, RISK)[0])
        on = float(self.search.to_go.at(qx, qy)[0])
        return length + on + RISK.waiting * (SPEED * t1 - length) + max(standing, moving)


def headings() -> list[Point]:
    angles = [2.0 * math.pi * k / HEADINGS for k in range(1, HEADINGS + 1)]
    return [(math.cos(a), math.sin(a)) for a in angles]


posts = st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), min_size=1, max_size=6)


@settings(max_examples=40, deadline=None)
@given(posts, st.floats(-math.pi, math.pi), st.booleans())
def test_no_waypoint_on_a_heading_is_cheaper(
    points: list[Point], angle: float, crossed: bool
) -> None:
    """All are evaluated, though the search leaves out most by their least possible cost."""
    points = [p for p in points if math.hypot(*p) > 0.4] or [(0.8, 0.0)]
    goal = (4.0 * math.cos(angle), 4.0 * math.sin(angle))
    person = Circle(center_m=(1.0, -2.0), radius_m=0.6, velocity_mps=(0.0, 0.8))
    one = Setting(PointMap(points), goal, *((person,) if crossed else ()))
    found = one.found()
    assert found.cost == pytest.approx(one.cost(found.waypoint, found.t1))
    if found.free:
        assert found.cost == pytest.approx(
            math.hypot(*found.waypoint)
            + float(one.search.to_go.at(*(np.array([q]) for q in found.waypoint))[0])
        )
        assert (found.closed, found.candidates) == ((), ())
        return
    least = min(
        one.cost((c * share * REACH_M, s * share * REACH_M), share * REACH_M / SPEED)
        for c, s in headings()
        for share in LENGTHS
    )
    assert found.cost <= least * (1.0 + 1e-9)
    assert len(found.candidates) == BAT.population


@settings(max_examples=60, deadline=None)
@given(posts, st.floats(-math.pi, math.pi), st.booleans(), st.booleans())
def test_what_the_last_decision_was_changes_only_in_which_calls_waypoints_are_evaluated(
    points: list[Point], angle: float, crossed: bool, turns: bool
) -> None:
    points = [p for p in points if math.hypot(*p) > 0.4] or [(0.8, 0.0)]
    goal = (4.0 * math.cos(angle), 4.0 * math.sin(angle))
    person = Circle(center_m=(1.0, -2.0), radius_m=0.6, velocity_mps=(0.0, 0.8))
    base = Base(drive=Drive.DIFFERENTIAL if turns else Drive.OMNIDIRECTIONAL)
    one = Setting(PointMap(points), goal, *((person,) if crossed else ()), base=base)
    once = one.found()  # as after a free way, which is how it begins
    again = one.found()
    assert again.waypoint == pytest.approx(once.waypoint)
    assert again.cost == pytest.approx(once.cost)
    assert (again.free, again.closed) == (once.free, once.closed)


@settings(max_examples=40, deadline=None)
@given(posts)
def test_the_bits_are_the_headings_whose_first_waypoint_is_not_reached(
    points: list[Point],
) -> None:
    points = [p for p in points if math.hypot(*p) > 0.4] + [(0.9, 0.0)]
    one = Setting(PointMap(points), (4.0, 0.0))
    found = one.found()
    if found.free:
        return
    length = LENGTHS[0] * REACH_M
    known = PointMap(points).map_points()
    for (c, s), bit in zip(headings(), found.closed):
        share = np.linspace(0.05, 1.0, 60)[:, None] * length
        line = share * np.array([c, s])
        nearest = [
            min(float(np.hypot(*(part - p).T).min()) for p in known) for part in (line, line[:48])
        ]  # at its end it need not be noticed
        if nearest[1] < RADIUS_M - 0.02:
            assert bit == 1
        elif nearest[0] > RADIUS_M + 0.06:
            assert bit == 0


def test_the_last_waypoint_is_kept_where_it_is_cheaper_than_the_headings() -> None:
    """It lies between them; the bats search around it."""
    person = Circle(center_m=(2.5, 0.1), radius_m=0.6, velocity_mps=(-0.8, 0.0))
    known = PointMap(polyline((1.0, -0.6), (1.0, 0.1)))
    fresh, again = (Setting(known, (3.0, 0.0), person) for _ in range(2))
    between = [
        (length * math.cos(a), length * math.sin(a))
        for a in np.linspace(-1.5, 1.5, 61).tolist()
        for length in (0.4, 0.9, 1.1, 1.5, 2.2)
    ]
    best = min(between, key=lambda q: fresh.cost(q, math.hypot(*q) / SPEED))
    without, with_last = fresh.found(), again.found(last=best)
    assert not without.free
    assert fresh.cost(best, math.hypot(*best) / SPEED) < without.cost
    assert with_last.cost <= fresh.cost(best, math.hypot(*best) / SPEED) + 1e-9
    assert again.centers == [best]


def test_where_nothing_leads_on_the_cost_says_so() -> None:
    ring = [(0.35 * math.cos(a), 0.35 * math.sin(a)) for a in np.linspace(0.0, 6.28, 60).tolist()]
    one = Setting(PointMap(ring), (3.0, 0.0))
    found = one.found()
    assert found.cost >= FORBIDDEN_M
    assert sum(found.closed) == HEADINGS


@pytest.mark.parametrize("drive", list(Drive))
def test_unobserved_headings_are_neither_taken_nor_open(drive: Drive) -> None:
    observed = np.ones(HEADINGS, dtype=bool)
    observed[:40] = False
    one = Setting(PointMap([(0.9, 0.0)]), (3.0, 0.0), base=Base(drive=drive))
    found = one.found(observed)
    (x, y), n = found.waypoint, HEADINGS
    assert observed[(round(math.atan2(y, x) * n / (2.0 * math.pi)) - 1) % n]
    assert all(found.closed[:40])
    assert not all(found.closed)


def test_clearances_are_taken_once_per_decision() -> None:
    known = PointMap([(1.0, 0.0)])
    search = MapSearch(RouteParams(), RADIUS_M, HEADINGS, REACH_M)
    first = search.clearance(known, HERE, 10**9)
    assert search.clearance(known, HERE, 10**9) is first
    known.mark([(2.0, 0.5)])
    again = search.clearance(known, (2.0, 0.0), 2 * 10**9)
    assert float(again.at(np.array([2.0]), np.array([0.3]))[0]) == pytest.approx(0.2, abs=0.03)
    assert float(first.at(np.array([2.0]), np.array([0.3]))[0]) == known.params.widest_m


def test_the_path_ahead_is_looked_along_as_far_as_it_is_in_view() -> None:
    """Round the end of a wall: the first waypoint is beside the end, not behind the wall."""
    known = PointMap(polyline((1.0, -3.0), (1.0, 0.6)))
    one = Setting(known, (2.5, -0.5))
    found = one.found()
    path = np.linspace(0.0, 1.0, 100)[:, None] * np.array(found.waypoint)
    assert known.least_m(path) > RADIUS_M
    assert found.waypoint[1] > 0.5
    assert math.hypot(*found.waypoint) > 0.8
