# SPDX-License-Identifier: Apache-2.0
"""Rollouts through a place: their paths against the simulated base, their risks by sampling."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from point_maps import PointMap, polyline

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Circle, Decision, Mode
from mfba_planner.core.robot_base import Base, Drive
from mfba_planner.planning.differential_drive import Speeds, apply_command, command
from mfba_planner.planning.distance_to_go import DistanceToGo, RouteParams
from mfba_planner.planning.map_rollout import FORBIDDEN_M, MapRollout
from mfba_planner.planning.trajectory_cost import RiskParams, TrajectoryCost
from mfba_planner.planning.turning_rollout import FINE_STEPS, LATE_S, Paths

RADIUS_M, SPEED, TICK_S, TICK_NS = 0.3, 0.8, 0.1, 100_000_000
OMNI, TURNS = Base(), Base(drive=Drive.DIFFERENTIAL)
RISK = RiskParams()
FAR = Circle(center_m=(0.5, -2.5), radius_m=0.5, velocity_mps=(0.0, 0.1))  # in reach, no risk
MARGIN_M = 0.1
REST = Speeds()

waypoints = st.tuples(st.floats(0.3, 2.5), st.floats(-math.pi, math.pi)).map(
    lambda polar: (polar[0] * math.cos(polar[1]), polar[0] * math.sin(polar[1]))
)


def rollout(
    known: PointMap,
    goal: Point = (9.0, 0.0),
    *circles: Circle,
    position: Point = (0.0, 0.0),
    yaw: float = 0.0,
    base: Base = OMNI,
    speeds: Speeds = REST,
    horizon_s: float = RISK.horizon_s,
) -> tuple[MapRollout, DistanceToGo]:
    to_go = DistanceToGo(RouteParams(), RADIUS_M)
    to_go.update(1, known, position, goal)
    field = known.distance_field(position, 14.0, 0.05)
    made = MapRollout(
        position, yaw, speeds, base, RADIUS_M, SPEED, TICK_S, to_go, field, circles, horizon_s,
    )  # fmt: skip
    return made, to_go


def through(made: MapRollout, waypoint: Point, t1: float | None = None) -> Paths:
    qx, qy = np.array([waypoint[0]]), np.array([waypoint[1]])
    return made.paths(qx, qy, np.array([t1 or math.hypot(*waypoint) / SPEED]))


@given(waypoints, st.floats(1.0, 3.0))
def test_an_omnidirectional_base_drives_to_the_waypoint_and_on_to_the_goal(
    waypoint: Point, waiting: float
) -> None:
    """In t1 to the waypoint, then at full speed; the tick that reaches it ends there."""
    goal, start = (3.0, 1.0), (-1.0, 0.5)
    t1 = waiting * math.hypot(*waypoint) / SPEED
    made, _ = rollout(PointMap(), goal, FAR, position=start)
    assert not made.alone
    paths = through(made, waypoint, t1)
    ticks = math.ceil(t1 / TICK_S - 1e-9)
    assert paths.arrived[0] == min(ticks, paths.x.shape[1] - 1)
    middle = (start[0] + waypoint[0], start[1] + waypoint[1])
    rest = math.dist(middle, goal)
    driven = 0.0
    for k in range(paths.x.shape[1]):
        share = min(k * TICK_S / t1, 1.0)
        later = min(max(k - ticks, 0) * SPEED * TICK_S, rest) / rest
        expected = (
            start[0] + share * waypoint[0] + later * (goal[0] - middle[0]),
            start[1] + share * waypoint[1] + later * (goal[1] - middle[1]),
        )
        assert (paths.x[0, k], paths.y[0, k]) == pytest.approx(expected, abs=1e-9)
        driven = (share * math.hypot(*waypoint) + later * rest) / SPEED
        assert paths.driven_s[0, k] == pytest.approx(driven, abs=1e-9)
    if paths.x.shape[1] * TICK_S < 2.0 * RISK.horizon_s:  # the longest, waiting included
        assert driven >= min(RISK.horizon_s, (math.hypot(*waypoint) + rest) / SPEED) - TICK_S


def test_the_second_part_follows_the_shortest_path() -> None:
    known = PointMap(polyline((2.0, -1.0), (2.0, 1.5)))
    made, to_go = rollout(known, (4.0, 0.0), FAR)
    paths = through(made, (1.0, -1.0))
    path = np.stack((paths.x[0], paths.y[0]), axis=1)
    assert known.least_m(path) > RADIUS_M - 0.03
    values = to_go.at(path[:, 0], path[:, 1])[paths.arrived[0] :]
    assert (np.diff(values) < -0.6 * SPEED * TICK_S).all()


@given(st.lists(waypoints, min_size=1, max_size=5))
def test_where_nothing_moves_they_are_the_lines_to_the_waypoints(
    chosen: Sequence[Point],
) -> None:
    made, _ = rollout(PointMap(), position=(2.0, 1.0))
    assert made.alone
    qx, qy = np.array(chosen).T
    paths = made.paths(qx, qy, np.hypot(qx, qy) / SPEED)
    assert paths.arrived == pytest.approx(np.ceil(np.hypot(qx, qy) / (SPEED * TICK_S)))
    assert paths.x[:, -1] == pytest.approx(2.0 + qx)
    assert paths.y[:, -1] == pytest.approx(1.0 + qy)
    assert paths.driven_s[:, -1] == pytest.approx(np.hypot(qx, qy) / SPEED)
    steps = np.hypot(np.diff(paths.x), np.diff(paths.y))
    assert (steps <= SPEED * TICK_S + 1e-9).all()
    assert steps.sum(axis=1) == pytest.approx(np.hypot(qx, qy))
    assert (made.moving_risk(paths, RISK) == 0.0).all()


@settings(max_examples=40, deadline=None)
@given(st.lists(waypoints, min_size=2, max_size=5), st.booleans(), st.booleans())
def test_a_rollout_does_not_depend_on_those_beside_it(
    chosen: Sequence[Point], turns: bool, alone: bool
) -> None:
    known = PointMap([(0.6, 0.2), (-0.5, 0.4), (1.5, -0.4)])
    made, _ = rollout(known, (9.0, 0.0), *(() if alone else (FAR,)), base=TURNS if turns else OMNI)
    qx, qy = np.array(chosen).T
    t1 = np.hypot(qx, qy) / SPEED
    t1[0] *= 2.5  # this one waits
    together = made.paths(qx, qy, t1)
    for k, point in enumerate(chosen):
        one = through(made, point, float(t1[k]))
        for risk in (
            lambda paths: made.standing_risk(paths, RISK, MARGIN_M),
            lambda paths: made.moving_risk(paths, RISK),
            lambda paths: paths.slowed_m,
        ):
            assert float(risk(together)[k]) == pytest.approx(float(risk(one)[0]), abs=1e-9)
        n = min(one.x.shape[1], together.x.shape[1])
        assert together.x[k, :n] == pytest.approx(one.x[0, :n])


def driven_base(
    base: Base, yaw: float, speeds: Speeds, waypoint: Point, goal: Point, ticks: int, slow_s: float
) -> list[Pose2D]:
    """The simulated base, commanded at every tick: to the waypoint, then to the goal.

    slow_s > 0: at half speed towards the waypoint for that time, and then to the goal.
    """
    pose, target = Pose2D(0.0, 0.0, yaw), waypoint
    poses = [pose]
    for k in range(ticks):
        near = max(0.1, abs(speeds.v) * TICK_S)
        if k * TICK_S >= slow_s if slow_s else math.dist(pose.position, target) < near:
            target = goal
        dx, dy = target[0] - pose.x, target[1] - pose.y
        scale = SPEED * (0.5 if slow_s and target is not goal else 1.0) / math.hypot(dx, dy)
        decision = Decision(
            stamp_ns=0, mode=Mode.PATH_GENERATION, reason="", pose=pose, goal=goal, ranges_m=(),
            vs=(), vg=(), gap=0, waypoint=goal, velocity=(dx * scale, dy * scale),
        )  # fmt: skip
        given_speeds = command(decision, base, TICK_NS)
        pose, speeds = apply_command(pose, speeds, given_speeds, base, TICK_NS)
        poses.append(pose)
    return poses


@settings(max_examples=100, deadline=None)
@given(
    st.floats(-math.pi, math.pi),
    waypoints,
    st.booleans(),
    st.floats(0.0, 0.8),
    st.floats(-1.0, 1.0),
    st.sampled_from([0.0, 1.0, 2.0]),
)
def test_a_differential_base_is_where_the_simulated_one_is(
    yaw: float, waypoint: Point, reverse: bool, v: float, omega: float, slow_s: float
) -> None:
    off = abs(math.remainder(yaw - math.atan2(waypoint[1], waypoint[0]), 2.0 * math.pi))
    assume(abs(off - 0.5 * math.pi) > 0.3 and off < 2.7)  # else it may turn to either side
    base, goal = replace(TURNS, reverse=reverse), (9.0, 0.0)
    speeds = Speeds(v, omega)
    if slow_s:
        scale = 0.5 * SPEED * slow_s / math.hypot(*waypoint)
        waypoint = (waypoint[0] * scale, waypoint[1] * scale)
    made, _ = rollout(PointMap(), goal, FAR, yaw=yaw, base=base, speeds=speeds)
    paths = through(made, waypoint, slow_s or None)
    length = paths.x.shape[1]
    ticks = np.round(np.cumsum([0.0, *paths.step_s]) / TICK_S).astype(int)
    poses = driven_base(base, yaw, speeds, waypoint, goal, int(ticks[-1]), slow_s)
    real = np.array([poses[tick].position for tick in ticks.tolist()])
    away = np.hypot(paths.x[0] - real[:, 0], paths.y[0] - real[:, 1])
    first = paths.arrived[0]
    assert away[: min(first, FINE_STEPS) + 1].max() < 0.05
    driven = np.array([pose.position for pose in poses])
    beside = np.hypot(paths.x[0][:, None] - driven[:, 0], paths.y[0][:, None] - driven[:, 1]).min(
        axis=1
    )  # longer steps are late, by up to 0.4 m, but not beside the path
    late = int(np.searchsorted(ticks * TICK_S, LATE_S))
    assert beside[: first + 1].max() < 0.12
    assert beside[: min(first + 6, late, length)].max() < 0.2
    assert beside[: min(first + 6, length)].max() < 0.3
    steps = np.hypot(np.diff(paths.x[0]), np.diff(paths.y[0]))
    assert paths.driven_s[0, 1:] == pytest.approx(np.cumsum(steps) / SPEED, abs=1e-3)


def test_a_differential_base_slows_down_where_it_is_narrow() -> None:
    walls = polyline((-1.0, 0.36), (4.0, 0.36)) + polyline((-1.0, -0.36), (4.0, -0.36))
    narrow, _ = rollout(PointMap(walls), base=TURNS, speeds=Speeds(SPEED, 0.0))
    wide, _ = rollout(PointMap(), base=TURNS, speeds=Speeds(SPEED, 0.0))
    ends = [float(through(made, (2.5, 0.0)).x[0, 12]) for made in (narrow, wide)]
    assert 0.3 * ends[1] < ends[0] < 0.9 * ends[1]


def test_what_a_differential_base_stays_behind_counts_until_its_waypoint() -> None:
    """At 0.4 of the speed it stays behind by 1.5 m per metre, the last step among them."""
    walls = polyline((-1.0, 0.35), (4.0, 0.35)) + polyline((-1.0, -0.35), (4.0, -0.35))
    for circles in ((), (FAR,)):
        made, _ = rollout(
            PointMap(walls), (9.0, 0.0), *circles, base=TURNS, speeds=Speeds(0.4 * SPEED, 0.0)
        )
        paths = through(made, (1.0, 0.0))
        driven_m = float(paths.driven_s[0, paths.arrived[0]]) * SPEED
        assert 0.85 < driven_m < 1.0
        assert float(paths.slowed_m[0]) == pytest.approx(1.5 * driven_m, rel=1e-6)


circles = st.builds(
    lambda x, y, vx, vy, r: Circle(center_m=(x, y), velocity_mps=(vx, vy), radius_m=r),
    st.floats(-4.0, 4.0),
    st.floats(-4.0, 4.0),
    st.floats(-1.5, 1.5),
    st.floats(-1.5, 1.5),
    st.floats(0.4, 0.8),
)


def sampled_risk(
    paths: Paths, row: int, circle: Circle, risk: RiskParams, slack_m: float = 0.0
) -> float:
    """The risk of one path and circle by 1600 times per step; docs of TrajectoryCost.

    With a slack the circle is larger by it, and what is almost at rest beside it approaches.
    """
    (vx, vy), r = circle.velocity_mps, circle.radius_m + slack_m
    margin, close = risk.around(math.hypot(vx, vy), TICK_S)
    worst = 0.0
    share = np.linspace(0.0, 1.0, 1601)
    for k, step_s in enumerate(paths.step_s.tolist()):
        t = float(paths.step_s[:k].sum()) + share * step_s
        x = paths.x[row, k] + share * (paths.x[row, k + 1] - paths.x[row, k])
        y = paths.y[row, k] + share * (paths.y[row, k + 1] - paths.y[row, k])
        away = np.hypot(circle.center_m[0] + vx * t - x, circle.center_m[1] + vy * t - y)
        driven = float(paths.driven_s[row, k])
        if (
            driven >= risk.horizon_s
            or away[1] >= away[0] + 1e-3 * slack_m
            or away.min() >= r + margin
        ):
            continue
        nearest = int(away.argmin())
        left = max(1.0 - (driven + share[nearest] * step_s) / risk.horizon_s, 0.0)
        found = close * min(1.0 - (away[nearest] - r) / margin, 1.0) * left
        if away.min() < r:
            met = float(share[(away < r).argmax()]) * step_s
            urgency = max(1.0 - (driven + met) / risk.horizon_s, 0.0) ** 2
            found += urgency * (risk.contact_m + risk.urgent_m * urgency**3)
        worst = max(worst, found)
    return worst


@settings(max_examples=100, deadline=None)
@given(circles, waypoints, st.sampled_from([OMNI, TURNS]), st.floats(1.0, 2.0))
@example(
    Circle(center_m=(-0.5, 0.0), velocity_mps=(8e-12, 0.0), radius_m=0.5), (0.0, 1.0), TURNS, 1.0
)
def test_the_risk_of_what_moves_is_the_one_by_sampling(
    circle: Circle, waypoint: Point, base: Base, waiting: float
) -> None:
    assume(math.hypot(*circle.center_m) > 0.05)  # else no way leads away
    made, _ = rollout(PointMap(), (9.0, 0.0), circle, FAR, base=base)
    qx, qy = np.array([waypoint[0], -waypoint[0]]), np.array([waypoint[1], 0.1])
    paths = made.paths(qx, qy, waiting * np.hypot(qx, qy) / SPEED)
    # A touch is contact or not, and one that hardly moves approaches or not: both may be right.
    for row, found in enumerate(made.moving_risk(paths, RISK).tolist()):
        far = sampled_risk(paths, row, FAR, RISK)
        expected = [
            max(sampled_risk(paths, row, circle, RISK, slack), far) for slack in (-1e-6, 0.0, 1e-6)
        ]
        assert 0.97 * min(expected) - 0.01 <= found <= 1.03 * max(expected) + 0.01


@pytest.mark.parametrize(("horizon_s", "counts"), [(3.0, False), (5.0, True)])
def test_what_moves_counts_within_the_horizon_of_the_rollout(
    horizon_s: float, counts: bool
) -> None:
    """Met after 4 s of driving; the 3 s of the weights are for what stands."""
    crossing = Circle(center_m=(3.2, -2.0), velocity_mps=(0.0, 0.5), radius_m=0.35)
    for base in (OMNI, TURNS):
        made, _ = rollout(PointMap(), (9.0, 0.0), crossing, base=base, horizon_s=horizon_s)
        paths = through(made, (1.0, 0.0))
        assert (float(made.moving_risk(paths, RISK)[0]) > 0.0) == counts


@settings(max_examples=100, deadline=None)
@given(circles, waypoints)
def test_in_the_open_it_is_the_risk_of_the_open_planner(circle: Circle, waypoint: Point) -> None:
    """TrajectoryCost takes both legs whole; here the leg ends with a tick, up to a tick later."""
    goal = (6.0, 0.0)
    length = max(round(math.hypot(*waypoint) / (SPEED * TICK_S)), 1) * SPEED * TICK_S
    scale = length / math.hypot(*waypoint)
    waypoint = (waypoint[0] * scale, waypoint[1] * scale)
    assume(math.hypot(*circle.center_m) > 0.05)  # else no way leads away
    for start, end in (((0.0, 0.0), waypoint), (waypoint, goal)):
        ahead = (end[0] - start[0], end[1] - start[1])
        beside = (circle.center_m[0] - start[0], circle.center_m[1] - start[1])
        across = abs(ahead[0] * beside[1] - ahead[1] * beside[0]) / math.hypot(*ahead)
        assume(abs(across - circle.radius_m) > 1e-6)  # a tangent is contact or not
    made, _ = rollout(PointMap(), goal, circle, FAR)
    found = float(made.moving_risk(through(made, waypoint), RISK)[0])
    costs = TrajectoryCost((0.0, 0.0), [circle, FAR], RISK, TICK_S, SPEED)
    free = TrajectoryCost((0.0, 0.0), [], RISK, TICK_S, SPEED)
    expected = costs.cost(waypoint, length / SPEED, goal, SPEED)
    expected -= free.cost(waypoint, length / SPEED, goal, SPEED)
    # By steps the largest of a pass may be before its nearest.
    close = max(RISK.around(math.hypot(*c.velocity_mps), TICK_S)[1] for c in (circle, FAR))
    assert expected - 1e-6 * (1.0 + expected) <= found <= expected + close


def test_no_obstacle_in_reach_means_alone() -> None:
    for away_m, velocity, alone in (
        (30.0, (0.0, 0.0), True),
        (30.0, (-12.0, 0.0), False),
        (2.0, (0.0, 0.0), False),
    ):
        circle = Circle(center_m=(away_m, 0.0), radius_m=0.5, velocity_mps=velocity)
        assert rollout(PointMap(), (9.0, 0.0), circle)[0].alone == alone
        assert rollout(PointMap(), (9.0, 0.0), circle, FAR)[0].alone is False


@settings(max_examples=100, deadline=None)
@given(circles, st.floats(1.0, 3.0), waypoints)
def test_alone_nothing_can_be_met_within_the_horizon(
    circle: Circle, farther: float, waypoint: Point
) -> None:
    x, y = circle.center_m
    circle = replace(circle, center_m=(farther * x, farther * y))
    made, _ = rollout(PointMap(), (9.0, 0.0), circle)
    if made.alone:
        away = math.hypot(*circle.center_m) - circle.radius_m
        speed = math.hypot(*circle.velocity_mps) + SPEED
        margin = RISK.around(math.hypot(*circle.velocity_mps), TICK_S)[0]
        assert away - speed * RISK.horizon_s > margin
        full, _ = rollout(PointMap(), (9.0, 0.0), FAR)
        assert sampled_risk(through(full, waypoint), 0, circle, RISK) == 0.0


def standing(
    known: PointMap, *waypoint_list: Point, moving: bool = False, base: Base = OMNI
) -> list[float]:
    made, _ = rollout(known, (9.0, 0.0), *((FAR,) if moving else ()), base=base)
    qx, qy = np.array(waypoint_list).T
    paths = made.paths(qx, qy, np.hypot(qx, qy) / SPEED)
    found: list[float] = made.standing_risk(paths, RISK, MARGIN_M).tolist()
    return found


@pytest.mark.parametrize("base", [OMNI, TURNS])
def test_contact_before_the_waypoint_is_forbidden(base: Base) -> None:
    wall = PointMap(polyline((1.5, -3.0), (1.5, 3.0)))
    through_it, short_of_it, along_it = standing(
        wall, (2.2, 0.0), (0.8, 0.0), (1.0, 0.9), base=base
    )
    assert through_it >= FORBIDDEN_M
    assert short_of_it == 0.0
    assert along_it < FORBIDDEN_M


def test_contact_beyond_the_waypoint_costs_but_is_not_forbidden() -> None:
    """The shortest way itself is led through a door that the robot does not fit through."""
    wall = PointMap(polyline((1.5, -12.0), (1.5, 12.0)))
    found = standing(wall, (0.8, 0.0), (1.4, 0.0), moving=True)
    assert 1.0 < found[0] < FORBIDDEN_M <= found[1]


def test_the_less_room_and_the_sooner_the_greater_the_risk() -> None:
    """Passing a post at decreasing distances, and one that stands nearer."""
    found = [
        standing(PointMap([(away_m, beside_m)]), (2.5, 0.0))[0]
        for away_m, beside_m in ((1.5, 0.5), (1.5, 0.4), (1.5, 0.35), (0.7, 0.35), (1.5, 0.2))
    ]
    assert found[0] == 0.0
    assert sorted(found) == found
    assert len(set(found)) == 5
    assert found[3] < 10.0 < FORBIDDEN_M <= found[4]


def test_in_contact_already_the_path_out_is_allowed_and_the_path_in_is_not() -> None:
    wall = PointMap(polyline((0.25, -2.0), (0.25, 2.0)))
    out, along, inwards = standing(wall, (-1.0, 0.0), (0.0, 1.0), (1.0, 0.0))
    assert max(out, along) < FORBIDDEN_M <= inwards
    assert out <= along


@given(st.floats(0.35, 2.0), st.floats(-math.pi, math.pi))
def test_it_is_forbidden_exactly_where_the_line_comes_too_near(away_m: float, at: float) -> None:
    """One post, by the distance from the line in closed form."""
    post = (away_m * math.cos(at), away_m * math.sin(at))
    (found,) = standing(PointMap([post]), (1.6, 0.0))
    nearest = math.dist(post, (min(max(post[0], 0.0), 1.6), 0.0))
    if nearest < min(RADIUS_M - 0.02, away_m - 0.05):
        assert found >= FORBIDDEN_M
    elif nearest > RADIUS_M + 0.05 or nearest >= away_m:
        assert found < FORBIDDEN_M
    if nearest > RADIUS_M + MARGIN_M + 0.05:
        assert found == 0.0


def test_with_little_room_a_differential_base_turns_before_it_drives() -> None:
    """Driving while it turns, it may touch what stands beside it."""
    begins = []
    for room_m in (0.03, 0.05):
        off = RADIUS_M + room_m
        made, _ = rollout(PointMap([(0.0, off)]), yaw=0.35, base=TURNS)
        x = through(made, (1.5, 0.0)).x[0]
        begins.append(int((x > 0.005).argmax()))
    assert 0 < begins[1] < begins[0] - 1


@pytest.mark.parametrize(("room_m", "share"), [(0.3, 1.0), (0.1, 0.1 / 0.15), (0.02, 0.4)])
@pytest.mark.parametrize("circles", [(), (FAR,)])
def test_a_differential_base_stays_behind_where_it_slows_down(
    room_m: float, share: float, circles: tuple[Circle, ...]
) -> None:
    """Along a wall, until the waypoint; beyond it the distance to go counts."""
    off = RADIUS_M + room_m
    known = PointMap(polyline((-6.0, off), (6.0, off)))
    for base in (OMNI, TURNS):
        made, _ = rollout(known, (8.0, 0.0), *circles, base=base)
        slowed_m = float(through(made, (2.0, 0.0)).slowed_m[0])
        expected = 2.0 * (1.0 / share - 1.0) if base is TURNS else 0.0
        assert slowed_m == pytest.approx(expected, rel=0.15, abs=1e-9)
