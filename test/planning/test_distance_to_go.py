# SPDX-License-Identifier: Apache-2.0
"""Distance to go, against shortest ways that are known in closed form."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from point_maps import PointMap, polyline

from mfba_planner.core.geometry import Point
from mfba_planner.planning.distance_to_go import DistanceToGo, RouteParams, is_clear

RADIUS_M = 0.3
START = (0.0, 0.0)
SECOND_NS = 1_000_000_000
ROUND = 0.03  # share by which fast marching may be too short or too long
CELL_M = 0.15

position = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))


def made(known: PointMap, goal: Point, start: Point = START) -> DistanceToGo:
    to_go = DistanceToGo(RouteParams(), RADIUS_M)
    to_go.update(SECOND_NS, known, start, goal)
    return to_go


def at(to_go: DistanceToGo, point: Point) -> float:
    return float(to_go.at(np.array([point[0]]), np.array([point[1]]))[0])


def followed(to_go: DistanceToGo, start: Point, length_m: float) -> np.ndarray:
    """Positions (k, 2) along direction(), 2 cm apart, until 0.3 m before the goal."""
    x, y = np.array([start[0]]), np.array([start[1]])
    path = [(start[0], start[1])]
    for _ in range(round(length_m / 0.02)):
        ux, uy = to_go.direction(np.stack((x, y)))
        assert math.hypot(float(ux[0]), float(uy[0])) == pytest.approx(1.0)
        one = to_go.direction_at(float(x[0]), float(y[0]))
        assert one == pytest.approx((float(ux[0]), float(uy[0])))
        x, y = x + 0.02 * ux, y + 0.02 * uy
        path.append((float(x[0]), float(y[0])))
        if math.dist(path[-1], to_go.goal) < 0.3:
            break
    return np.array(path)


def round_the_end(start: Point, end: Point, goal: Point, room_m: float) -> float:
    """Length of the string from start to goal around a disc about the end of a wall."""
    a, b = math.dist(start, end), math.dist(end, goal)
    bend = math.acos(  # on the side of the wall; the string is on the other
        ((start[0] - end[0]) * (goal[0] - end[0]) + (start[1] - end[1]) * (goal[1] - end[1]))
        / (a * b)
    )
    arc = 2.0 * math.pi - bend - math.acos(room_m / a) - math.acos(room_m / b)
    assert arc > 0.0
    return math.sqrt(a * a - room_m**2) + math.sqrt(b * b - room_m**2) + room_m * arc


@given(position, position)
def test_where_nothing_is_known_it_is_the_straight_line(goal: Point, point: Point) -> None:
    to_go = made(PointMap(), goal)
    assert to_go.is_straight
    assert at(to_go, point) == pytest.approx(math.dist(point, goal), abs=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.floats(1.0, 4.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_in_view_of_the_goal_it_is_the_straight_line(x: float, y: float, gy: float) -> None:
    """The wall is behind them and farther away than where the robot slows down."""
    goal = (6.0, gy)
    to_go = made(PointMap(polyline((0.0, -3.0), (0.0, 3.0))), goal, (-1.0, 0.0))
    assert not to_go.is_straight
    expected = math.dist((x, y), goal)
    assert at(to_go, (x, y)) == pytest.approx(expected, rel=ROUND, abs=CELL_M)
    ux, uy = to_go.direction(np.array([[x], [y]]))
    cosine = (float(ux[0]) * (6.0 - x) + float(uy[0]) * (gy - y)) / expected
    assert cosine > math.cos(math.radians(15.0))


@pytest.mark.parametrize("high", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("goal", [(4.0, 0.0), (3.5, -1.0)])
def test_round_a_wall_it_is_the_string_round_its_end(high: float, goal: Point) -> None:
    """At least the string in touch with the end, at most the one where nothing slows it down."""
    known = PointMap(polyline((2.0, -5.0), (2.0, high)))
    found = at(made(known, goal), START)
    shortest = round_the_end(START, (2.0, high), goal, RADIUS_M)
    unhindered = round_the_end(START, (2.0, high), goal, 0.8)
    assert shortest - CELL_M < found < unhindered * (1.0 + ROUND) + CELL_M
    assert unhindered < 1.3 * shortest


def test_the_shorter_path_round_is_taken() -> None:
    known = PointMap(polyline((2.0, -1.0), (2.0, 2.0)))
    path = followed(made(known, (4.0, 0.0)), START, 9.0)
    assert math.dist(tuple(path[-1]), (4.0, 0.0)) < 0.3
    assert path[:, 1].min() < -1.0 - RADIUS_M + 0.05
    assert path[:, 1].max() < 0.5


@pytest.mark.parametrize("width_m", [0.5, 0.72, 0.9])
def test_a_door_is_taken_where_the_robot_fits(width_m: float) -> None:
    half = 0.5 * width_m
    known = PointMap(polyline((2.0, -3.0), (2.0, -half)) + polyline((2.0, half), (2.0, 3.0)))
    to_go = made(known, (4.0, 0.1), (0.0, 0.1))
    path = followed(to_go, (0.0, 0.1), 12.0)
    assert math.dist(tuple(path[-1]), (4.0, 0.1)) < 0.3
    crossing = path[np.abs(path[:, 0] - 2.0).argmin(), 1]
    assert (abs(crossing) < half) == (width_m > 2.0 * RADIUS_M)


def test_what_is_unknown_counts_as_free() -> None:
    """Of a wall only the part that was seen: it may end there."""
    part, whole = PointMap(polyline((2.0, -1.0), (2.0, 1.0))), PointMap()
    whole.mark(polyline((2.0, -4.0), (2.0, 4.0)))
    assert at(made(part, (4.0, 0.0)), START) < at(made(whole, (4.0, 0.0)), START) - 3.0


discs = st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), min_size=1, max_size=8)


@settings(max_examples=30, deadline=None)
@given(discs, st.tuples(st.floats(-6.0, 6.0), st.floats(5.0, 7.0)))
def test_it_is_never_shorter_than_the_straight_line_and_falls_along_its_direction(
    centers: list[Point], goal: Point
) -> None:
    """A row of posts with a gap to the outside; goal and start are free."""
    start = (0.0, -5.0)
    points = [
        (x + 0.2 * math.cos(a), y + 0.2 * math.sin(a))
        for x, y in [*centers, (0.0, 0.0)]
        for a in np.linspace(0.0, 2.0 * math.pi, 24).tolist()
    ]
    known = PointMap(points)
    to_go = made(known, goal, start)
    path = followed(to_go, start, 40.0)
    values = to_go.at(path[:, 0], path[:, 1])
    straight = np.hypot(path[:, 0] - goal[0], path[:, 1] - goal[1])
    assert (values >= straight * (1.0 - ROUND) - CELL_M).all()
    assert math.dist(tuple(path[-1]), goal) < 0.3
    # 0.2 m farther on it is less by at least half of that.
    assert (values[:-10] - values[10:] > 0.1).all()
    assert known.least_m(path) > RADIUS_M - 0.05


def test_a_goal_far_away_is_measured_beyond_the_domain() -> None:
    known = PointMap(polyline((2.0, -2.0), (2.0, 2.0)))
    for goal in ((60.0, 0.0), (500.0, 300.0)):
        to_go = made(known, goal)
        assert not to_go.is_straight
        away = math.dist(START, goal)
        assert away - CELL_M < at(to_go, START) < away * 1.02 + 2.5
        path = followed(to_go, START, 10.0)
        assert known.least_m(path) > RADIUS_M - 0.05
        assert math.dist(tuple(path[-1]), goal) < away - 5.0
        assert at(to_go, tuple(path[-1])) < at(to_go, START) - 5.0


def test_where_the_robot_does_not_fit_it_stays_finite() -> None:
    ring = [(4.0 + math.cos(a), math.sin(a)) for a in np.linspace(0.0, 6.3, 180).tolist()]
    inside = made(PointMap(ring), (4.0, 0.0))
    outside = made(PointMap([(x - 4.0, y) for x, y in ring]), (4.0, 0.0))
    on_a_wall = made(PointMap(polyline((2.0, -1.0), (2.0, 1.0))), (2.0, 0.0))
    for to_go in (inside, outside, on_a_wall):
        found = at(to_go, START)
        assert math.isfinite(found)
        x, y = np.meshgrid(np.linspace(-20.0, 20.0, 41), np.linspace(-20.0, 20.0, 41))
        assert np.isfinite(to_go.at(x, y)).all()
        assert np.hypot(*to_go.direction(np.stack((x.ravel(), y.ravel())))).max() < 1.0 + 1e-9
    for to_go in (inside, outside):
        assert at(to_go, START) > 4.0 + 5.0, "a closed ring is no way"


def test_it_is_computed_again_only_when_the_map_has_changed_and_time_has_passed() -> None:
    known = PointMap(polyline((2.0, -1.0), (2.0, 1.0)))
    to_go = DistanceToGo(RouteParams(refresh_s=0.3), RADIUS_M)
    goal, stamp_ns = (4.0, 0.0), 5 * SECOND_NS
    to_go.update(stamp_ns, known, START, goal)
    before, fields = at(to_go, START), known.fields
    to_go.update(stamp_ns + 100 * SECOND_NS, known, START, goal)
    assert known.fields == fields, "the same map"
    to_go.update(stamp_ns, known, START, goal)
    known.mark(polyline((2.0, -3.0), (2.0, 3.0)))
    stamp_ns += SECOND_NS // 10
    to_go.update(stamp_ns, known, START, goal)
    assert at(to_go, START) == before, "too early"
    stamp_ns += SECOND_NS
    to_go.update(stamp_ns, known, START, goal)
    assert at(to_go, START) > before + 1.0


def test_another_goal_place_or_an_earlier_time_computes_it_at_once() -> None:
    def counted(stamp_ns: int, start: Point, goal: Point, *, marked: bool = False) -> int:
        known = PointMap(polyline((2.0, -1.0), (2.0, 1.0)))
        to_go = DistanceToGo(RouteParams(refresh_s=10.0), RADIUS_M)
        to_go.update(SECOND_NS, known, START, (4.0, 0.0))
        if marked:
            known.mark([(2.5, 1.5)])
        fields = known.fields
        to_go.update(stamp_ns, known, start, goal)
        assert at(to_go, goal) < 2.0 * CELL_M
        return known.fields - fields

    later = SECOND_NS + 1
    assert counted(later, START, (4.0, 0.01), marked=True) == 0, "noise of the odometry"
    assert counted(later, START, (4.0, 1.0)) == 1
    assert counted(later, (-14.0, 0.0), (4.0, 0.0)) == 1
    assert counted(SECOND_NS - 1, START, (4.0, 0.0), marked=True) == 1


def test_once_the_line_is_clear_it_is_straight_again() -> None:
    known = PointMap(polyline((2.0, -1.0), (2.0, 1.0)))
    to_go = made(known, (4.0, 0.0))
    assert at(to_go, START) > 4.1
    to_go.update(SECOND_NS + 1, known, (2.6, 0.0), (4.0, 0.0))
    assert to_go.is_straight
    assert at(to_go, START) == 4.0
    ux, uy = to_go.direction(np.array([[4.0, 0.0], [-2.0, 0.0]]))
    assert [*ux.tolist(), *uy.tolist()] == pytest.approx([0.0, 1.0, 1.0, 0.0])


@settings(max_examples=200, deadline=None)
@given(st.lists(position, max_size=5), position, position, st.floats(0.05, 1.0))
def test_a_line_is_clear_where_no_point_is_near_to_it(
    points: list[Point], start: Point, end: Point, room_m: float
) -> None:
    """By 2001 positions on the line; points beside the start and behind it do not count."""
    assume(math.dist(start, end) > 1e-6)  # a line leads somewhere
    found = is_clear(PointMap(points), start, end, room_m)
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    line = np.array(start) * (1.0 - share) + np.array(end) * share
    ahead = np.array(end) - np.array(start)
    nearest = math.inf
    for point in PointMap(points).map_points():
        if float((point - np.array(start)) @ ahead) > 0.0:
            nearest = min(nearest, float(np.hypot(*(line - point).T).min()))
    if abs(nearest - room_m) > 0.01:
        assert found == (nearest > room_m)


def test_what_stands_beside_the_robot_does_not_close_the_path_from_it() -> None:
    known = PointMap([(0.0, 0.2), (-0.1, 0.0)])
    assert is_clear(known, START, (3.0, 0.0), RADIUS_M)
    assert not is_clear(known, START, (-3.0, 0.0), RADIUS_M)
    assert is_clear(known, START, START, RADIUS_M)
    for line_m, clear in ((4e-181, True), (1e-160, True), (9e-7, True), (2e-6, False)):
        assert is_clear(known, START, (0.0, line_m), RADIUS_M) == clear, "nowhere, or up to it"


def closed_by(known: PointMap, goal: Point, seconds: float) -> str:
    """After so many seconds at rest, ten updates each, of a map that does not change."""
    to_go = DistanceToGo(RouteParams(), RADIUS_M)
    for k in range(round(10 * seconds) + 1):
        to_go.update(SECOND_NS + k * SECOND_NS // 10, known, START, goal)
    return to_go.closed_by


def test_what_closes_every_path_is_said_once_it_lasts() -> None:
    ring = [(math.cos(a), math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 180).tolist()]
    around_goal = PointMap([(4.0 + x, y) for x, y in ring])
    assert closed_by(around_goal, (4.0, 0.0), 0.5) == "", "a person may pass"
    assert "around the goal" in closed_by(around_goal, (4.0, 0.0), 5.0)
    assert "around the robot" in closed_by(PointMap(ring), (4.0, 0.0), 5.0)
    on_it = PointMap(polyline((4.0, -1.0), (4.0, 1.0)))
    assert "0.10 m from its middle" in closed_by(on_it, (4.1, 0.0), 5.0)
    opened = PointMap([(x, y) for x, y in ring if abs(y) > 0.4 or x > 0.0])
    assert closed_by(opened, (4.0, 0.0), 5.0) == ""


def test_a_path_that_opens_again_is_not_closed() -> None:
    ring = [(math.cos(a), math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 180).tolist()]
    to_go = DistanceToGo(RouteParams(), RADIUS_M)
    for second in range(1, 5):
        to_go.update(second * SECOND_NS, PointMap(ring), START, (4.0, 0.0))
    assert to_go.closed_by
    to_go.update(5 * SECOND_NS, PointMap(ring[30:]), START, (4.0, 0.0))
    assert to_go.closed_by
    opened = PointMap(ring[30:])
    opened.version += 1
    to_go.update(6 * SECOND_NS, opened, START, (4.0, 0.0))
    assert to_go.closed_by == ""


@pytest.mark.parametrize("half_m", [3.0, 5.5, 9.5])
def test_the_path_round_a_long_wall_is_found(half_m: float) -> None:
    """Also where its ends are farther away than what is looked at first."""
    known = PointMap(polyline((2.0, -half_m), (2.0, half_m)))
    found = at(made(known, (4.0, 0.0)), START)
    shortest = 2.0 * math.hypot(2.0, half_m)
    assert shortest < found < 1.1 * shortest + 2.0
    assert closed_by(known, (4.0, 0.0), 5.0) == ""


def test_a_passage_that_is_not_passed_is_gone_round_for_a_while() -> None:
    """A wall with a door, and an end farther away."""
    half, start, goal = RADIUS_M + 0.15, (0.0, 1.2), (4.0, 0.0)
    known = PointMap(polyline((2.0, -9.0), (2.0, -half)) + polyline((2.0, half), (2.0, 3.0)))
    to_go = made(known, goal, start)
    through_m, round_m = at(to_go, start), math.hypot(2.0, 1.8) + math.hypot(2.0, 3.0)
    assert through_m < 4.8 < round_m
    now_ns = 2 * SECOND_NS
    to_go.close(now_ns, (2.0, 0.0))
    to_go.update(now_ns, known, start, goal)
    assert at(to_go, start) > round_m
    assert not to_go.closed_by
    known.version += 1  # only then it is computed again
    to_go.update(now_ns + 30 * SECOND_NS - 1, known, start, goal)
    assert at(to_go, start) > round_m
    known.version += 1
    to_go.update(now_ns + 31 * SECOND_NS, known, start, goal)
    assert at(to_go, start) == pytest.approx(through_m, abs=1e-3)


@given(st.floats(0.31, 1.9), st.floats(-3.1, 3.1))
def test_headings_into_a_closed_passage_are_closed(away_m: float, angle: float) -> None:
    """Those whose line passes within the robot's radius of its middle."""
    to_go = made(PointMap(), (4.0, 0.0))
    headings = np.linspace(-math.pi, math.pi, 73)[1:]
    assert to_go.open(START, headings) is None
    to_go.close(SECOND_NS, (away_m * math.cos(angle), away_m * math.sin(angle)))
    found = to_go.open(START, headings)
    assert found is not None
    for heading, is_open in zip(headings.tolist(), found.tolist()):
        off = abs(math.remainder(heading - angle, 2.0 * math.pi))
        beside_m = away_m * math.sin(min(off, 0.5 * math.pi))
        if abs(beside_m - RADIUS_M) > 1e-9:
            assert is_open == (beside_m > RADIUS_M)


@pytest.mark.parametrize("away_m", [0.2, 2.1])
def test_a_passage_around_the_robot_or_far_off_closes_no_heading(away_m: float) -> None:
    to_go = made(PointMap(), (4.0, 0.0))
    to_go.close(SECOND_NS, (away_m, 0.0))
    assert to_go.open(START, np.zeros(1)) is None
