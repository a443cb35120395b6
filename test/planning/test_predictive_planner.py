# SPDX-License-Identifier: Apache-2.0
"""The predictive planner: evasion, free straight lines, limits, costs, cheapest candidate."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point, Pose2D, distance
from mfba_planner.core.planner_types import Circle, Mode, Observation
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.suites.named_suites import suite
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.planner_registry import make
from mfba_planner.planning.predictive_planner import Predictive, PredictiveParams, preset
from mfba_planner.planning.trajectory_cost import (
    RiskParams,
    TrajectoryCost,
    circles_from_sectors,
    predicted_circles,
)
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import Obstacle, Walls
from mfba_planner.simulation.planner_observations import Perception
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

PARAMS = preset(PlannerParams(speed_mps=0.8))
SENSOR = SensorParams()
STRAIGHT_M = 12.0 * math.sqrt(2.0)
GOAL = (9.0, 8.0)
POSE = Pose2D(1.0, 2.0)


def planner(seed: int = 0) -> Predictive:
    return Predictive(PARAMS, SENSOR, seed)


def drive(scenario: Scenario, seed: int = 0, name: str = "known", **kw: float) -> Episode:
    observer = Perception(name, sectors=False, seed=seed, **kw)  # type: ignore[arg-type]
    return run(scenario, planner=PARAMS, path_planner=planner(seed), seed=seed, observe=observer)


def observation(*circles: Circle, stamp_ns: int = 10**9, goal: Point = GOAL) -> Observation:
    return Observation(
        stamp_ns=stamp_ns, now_ns=stamp_ns, pose=POSE, ranges_m=(), goal=goal, circles=circles
    )


def mirrored(scenario: Scenario) -> Scenario:
    """The scenario with x and y exchanged: start and goal on the diagonal stay."""
    return replace(
        scenario,
        obstacles=tuple(
            replace(
                o,
                center_m=(o.center_m[1], o.center_m[0]),
                heading_rad=math.pi / 2.0 - o.heading_rad,
            )
            for o in scenario.obstacles
        ),
    )


def crowd(seed: int, count: int) -> Scenario:
    rng = np.random.default_rng(seed)
    obstacles: list[Obstacle] = []
    while len(obstacles) < count:
        x, y = rng.uniform(0.3, 11.7, 2).tolist()
        if min(math.hypot(x, y), math.hypot(12.0 - x, 12.0 - y)) > 0.7:
            speed, heading = rng.uniform(0.1, 0.3), rng.uniform(-math.pi, math.pi)
            obstacles.append(
                Obstacle(center_m=(x, y), radius_m=0.3, speed_mps=speed, heading_rad=heading)
            )
    return Scenario(
        name=f"crowd-{seed}",
        start_m=(0.0, 0.0),
        goal_m=(12.0, 12.0),
        obstacles=tuple(obstacles),
        walls=Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0)),
    )


circles = st.builds(
    lambda bearing, d, speed, heading: Circle(
        center_m=(POSE.x + d * math.cos(bearing), POSE.y + d * math.sin(bearing)),
        radius_m=0.6,
        velocity_mps=(speed * math.cos(heading), speed * math.sin(heading)),
    ),
    st.floats(-math.pi, math.pi),
    st.floats(0.0, 1.4),
    st.floats(0.0, 1.0),
    st.floats(-math.pi, math.pi),
)


@given(observed=st.lists(circles, max_size=12), seed=st.integers(0, 2**32))
@settings(max_examples=60)
def test_among_any_circles_velocities_are_finite_and_within_the_speed(
    observed: list[Circle], seed: int
) -> None:
    decision = planner(seed).plan(observation(*observed))
    assert math.hypot(*decision.velocity) <= PARAMS.speed_mps * (1.0 + 1e-9)
    assert all(map(math.isfinite, (*decision.velocity, *decision.waypoint)))
    assert decision == planner(seed).plan(observation(*observed))


@given(observed=st.lists(circles, min_size=1, max_size=5))
@settings(max_examples=60)
def test_a_free_straight_line_is_taken(observed: list[Circle]) -> None:
    off = math.pi / 2.0
    toward = math.atan2(GOAL[1] - POSE.y, GOAL[0] - POSE.x)
    behind = [
        c
        for c in observed
        if math.cos(math.atan2(c.center_m[1] - POSE.y, c.center_m[0] - POSE.x) - toward) < -0.1
        and math.hypot(*c.velocity_mps) < 0.3
        and distance(c.center_m, POSE.position) > 0.8
    ]
    decision = planner().plan(observation(*behind))
    assert math.remainder(math.atan2(*decision.velocity[::-1]) - toward, 4.0 * off) == (
        pytest.approx(0.0, abs=1e-9)
    )
    assert math.hypot(*decision.velocity) == pytest.approx(PARAMS.speed_mps)
    assert decision.mode is Mode.PATH_GENERATION


@pytest.mark.parametrize("name", ["known", "scan-360", "scan-12"])
@pytest.mark.parametrize("aside_m", [0.0, 0.2, -0.4])
def test_an_obstacle_that_comes_head_on_is_passed(name: str, aside_m: float) -> None:
    scenario = Scenario(
        name="head-on",
        start_m=(0.0, 0.0),
        goal_m=(8.0, 0.0),
        obstacles=(
            Obstacle(center_m=(6.0, aside_m), radius_m=0.3, speed_mps=0.3, heading_rad=math.pi),
        ),
    )
    result = evaluate(drive(scenario, name=name))
    assert result.success
    assert result.length_m < 8.0 * (1.1 if name == "scan-12" else 1.06)


def test_enclosed_by_moving_obstacles_it_moves_to_the_latest_contact() -> None:
    left = Circle(center_m=(POSE.x - 0.7, POSE.y), radius_m=0.6, velocity_mps=(0.3, 0.0))
    right = Circle(center_m=(POSE.x + 0.9, POSE.y), radius_m=0.6, velocity_mps=(-0.3, 0.0))
    velocity = planner().plan(observation(left, right)).velocity
    assert abs(velocity[1]) > 0.5 * PARAMS.speed_mps


@pytest.mark.parametrize(
    ("case", "longest_m"), [("case1", 1.005 * 16.9706), ("case2", 1.01 * 17.008)]
)
def test_the_paper_s_cases_at_nearly_the_optimum(case: str, longest_m: float) -> None:
    for seed in range(3):
        result = evaluate(drive(load_scenario(case), seed))
        assert result.success
        assert result.length_m < longest_m


@pytest.mark.parametrize("seed", range(6))
def test_crowds_and_their_mirror_images_are_crossed_without_contact(seed: int) -> None:
    scenario = crowd(seed, 15)
    lengths = []
    for world in (scenario, mirrored(scenario)):
        result = evaluate(drive(world, seed))
        assert result.success
        lengths.append(result.length_m / STRAIGHT_M)
    assert max(lengths) < 1.15


def test_the_same_seed_decides_the_same_and_another_one_differs() -> None:
    world = crowd(3, 15)
    first = digest(drive(world, 1, "scan-360", noise_m=0.02, latency_ticks=1).ticks)
    again = digest(drive(world, 1, "scan-360", noise_m=0.02, latency_ticks=1).ticks)
    assert first == again
    assert digest(drive(world, 1).ticks) != digest(drive(world, 2).ticks)


def test_reset_drops_all_state() -> None:
    blocking = Circle(center_m=(2.0, 2.8), radius_m=0.6)
    path_planner = planner()
    first = path_planner.plan(observation(blocking))
    path_planner.plan(observation(blocking, stamp_ns=2 * 10**9))
    path_planner.reset()
    assert path_planner.plan(observation(blocking)) == first


def test_without_circles_and_scan_the_sectors_are_used() -> None:
    scenario = Scenario(
        name="post",
        start_m=(0.0, 0.0),
        goal_m=(6.0, 6.0),
        obstacles=(Obstacle(center_m=(3.0, 3.1), radius_m=0.3),),
    )
    result = evaluate(
        run(scenario, planner=PARAMS, path_planner=planner(), observe=Perception("sectors"))
    )
    assert result.success
    (circle,) = circles_from_sectors((1.0, 1.0), (math.inf, 0.5, math.inf, math.inf), 0.3)
    s = 0.8 / math.sqrt(2.0)
    assert circle.center_m == pytest.approx((1.0 - s, 1.0 + s))


def test_late_circles_are_predicted() -> None:
    (circle,) = predicted_circles(
        [Circle(center_m=(1.0, 1.0), radius_m=0.6, velocity_mps=(0.2, -0.1))], 0.5
    )
    assert circle.center_m == pytest.approx((1.1, 0.95))


@given(
    x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0), vx=st.floats(-0.5, 0.5),
    vy=st.floats(-0.5, 0.5), heading=st.floats(-math.pi, math.pi), t1=st.floats(0.1, 2.5),
)  # fmt: skip
@example(x=1.0, y=0.0, vx=0.4375, vy=0.0, heading=1.5, t1=0.5)
@example(x=0.875, y=-0.5, vx=-0.5, vy=-0.5, heading=-1.0, t1=0.125)
@settings(max_examples=200)
def test_a_cost_is_the_length_exactly_when_no_margin_is_entered(
    x: float, y: float, vx: float, vy: float, heading: float, t1: float
) -> None:
    risk = RiskParams()
    circle = Circle(center_m=(x, y), radius_m=0.6, velocity_mps=(vx, vy))
    margin, _ = risk.around(math.hypot(vx, vy), 0.1)  # a fast one has more
    if math.hypot(x, y) < 0.61 + margin:  # within the margin moving out is free
        return
    waypoint = (0.8 * t1 * math.cos(heading), 0.8 * t1 * math.sin(heading))
    goal = (9.0, 1.0)
    cost = TrajectoryCost((0.0, 0.0), [circle], risk, 0.1).cost(waypoint, t1, goal, 0.8)
    rest = distance(waypoint, goal)
    length = 0.8 * t1 + rest
    smallest = early_smallest = math.inf  # within tau, and within 0.9 tau
    moment = 0.0
    for t in np.linspace(0.0, risk.horizon_s, 3001).tolist():
        if t <= t1:
            position = (waypoint[0] * t / t1, waypoint[1] * t / t1)
        else:
            share = min(1.0, 0.8 * (t - t1) / rest)
            position = (
                waypoint[0] + share * (goal[0] - waypoint[0]),
                waypoint[1] + share * (goal[1] - waypoint[1]),
            )
        apart = distance(position, (x + vx * t, y + vy * t)) - 0.6
        if apart < smallest:
            smallest, moment = apart, t
        if t < 0.9 * risk.horizon_s:
            early_smallest = smallest
    if smallest > margin + 1e-3:
        assert cost == pytest.approx(length)
    elif smallest < margin - 2e-3 and moment < 0.9 * risk.horizon_s:
        assert cost > length  # a later closest approach may cost nothing yet
    if early_smallest < -2e-3:
        assert cost > length + 1e-6


@pytest.mark.parametrize("bearing", np.linspace(-math.pi, math.pi, 25).tolist())
def test_within_a_margin_moving_along_the_circle_is_free_and_closer_is_not(
    bearing: float,
) -> None:
    """Right angles have rounding errors; these must not count as an approach."""
    post = Circle(
        center_m=(0.605 * math.cos(bearing), 0.605 * math.sin(bearing)), radius_m=0.6
    )  # a margin is 0.015 m
    near = TrajectoryCost((0.0, 0.0), [post], RiskParams(), 0.1)
    for side in (-1.0, 1.0):
        for inward_rad, is_free in ((0.0, True), (1e-6, True), (1e-3, False)):
            heading = bearing + side * (math.pi / 2.0 - inward_rad)
            ux, uy = math.cos(heading), math.sin(heading)
            cost = near.cost((0.4 * ux, 0.4 * uy), 0.5, (4.0 * ux, 4.0 * uy), 0.8)
            assert (cost == pytest.approx(4.0, abs=1e-9)) == is_free
            (closed,) = near.closed(np.array([0.8 * ux]), np.array([0.8 * uy]))
            assert bool(closed) != is_free


def test_the_preset_changes_step_and_swarm_only() -> None:
    changed = preset(PlannerParams(speed_mps=0.7))
    assert changed.tick_ns == round(0.08 / 0.7 * 1e9)
    assert replace(changed, step_length_m=0.3, bat=PlannerParams().bat) == (
        PlannerParams(speed_mps=0.7)
    )
    assert isinstance(make("predictive", changed, SENSOR, 1), Predictive)
    assert PredictiveParams().headings == 72


@pytest.mark.parametrize(("suite_name", "k"), [("dense", 1074), ("adversarial", 1109)])
def test_near_waypoints_are_not_overshot_within_a_tick(suite_name: str, k: int) -> None:
    assert evaluate(drive(suite(suite_name).world(k))).success


@pytest.mark.parametrize("waypoint_m", [0.5, 1.0, 1.5])
def test_the_cost_of_a_contact_depends_on_the_driving_time_on_either_segment(
    waypoint_m: float,
) -> None:
    """x = 1 - s / tau: contact after 2.1 s, closest approach (distance 0) after 2.6 s."""
    risk = RiskParams(horizon_s=3.0, contact_m=3.0, urgent_m=100.0, close_m=0.3)
    ahead = Circle(center_m=(2.6, 0.0), radius_m=0.5)
    world = TrajectoryCost((0.0, 0.0), [ahead], risk, 0.1)
    contact, closest = 1.0 - 2.1 / 3.0, 1.0 - 2.6 / 3.0
    expected = 5.0 + 3.0 * contact**2 + 100.0 * contact**8 + 0.3 * closest
    found = world.cost((waypoint_m, 0.0), waypoint_m, (5.0, 0.0), 1.0)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("waypoint_m", [2.15, 2.3, 2.5])
def test_the_cost_of_a_contact_depends_on_its_start_wherever_the_segment_ends(
    waypoint_m: float,
) -> None:
    risk = RiskParams(horizon_s=3.0, contact_m=3.0, urgent_m=100.0, close_m=0.3)
    ahead = Circle(center_m=(2.6, 0.0), radius_m=0.5)
    found = TrajectoryCost((0.0, 0.0), [ahead], risk, 0.1).cost(
        (waypoint_m, 0.0), waypoint_m, (5.0, 0.0), 1.0
    )
    contact, end = 1.0 - 2.1 / 3.0, 1.0 - waypoint_m / 3.0
    assert found == pytest.approx(5.0 + 3.0 * contact**2 + 100.0 * contact**8 + 0.3 * end)


@given(
    crowd=st.lists(
        st.tuples(
            st.floats(0.62, 2.0), st.floats(-math.pi, math.pi),
            st.floats(-0.4, 0.4), st.floats(-0.4, 0.4),
        ),
        min_size=1, max_size=8,
    ),
    bound=st.one_of(st.just(math.inf), st.floats(5.0, 120.0)),
    first=st.integers(0, 35),
)  # fmt: skip
@settings(max_examples=150)
def test_the_cheapest_candidate_is_found_without_evaluating_all(
    crowd: list[tuple[float, float, float, float]], bound: float, first: int
) -> None:
    circles = [
        Circle(center_m=(r * math.cos(b), r * math.sin(b)), radius_m=0.6, velocity_mps=(vx, vy))
        for r, b, vx, vy in crowd
    ]
    goal, speed, candidates = (5.0, 1.0), 0.8, []
    for k in range(12):
        for length in (0.4, 1.0, 2.0):
            q = (length * math.cos(k * math.pi / 6.0), length * math.sin(k * math.pi / 6.0))
            candidates.append((length + distance(q, goal), q, length / speed, k))
    candidates = [
        (-math.inf, *candidates[first][1:3], -1),
        *sorted(candidates[:first] + candidates[first + 1 :]),
    ]
    world = TrajectoryCost((0.0, 0.0), circles, RiskParams(), 0.1, speed)
    costs = [world.cost(q, t1, goal, speed) for _, q, t1, _ in candidates]
    found = world.cheapest(candidates, goal, speed, bound)
    if found is None:
        assert min(costs) >= bound
    else:
        waypoint, t1, cost = found
        assert cost == min(costs) < bound
        assert costs[[(q, t) for _, q, t, _ in candidates].index((waypoint, t1))] == cost


def test_a_longer_candidate_in_the_same_direction_may_be_cheaper() -> None:
    """The risk of a slow approach is smaller if the segment ends later."""
    beside = Circle(center_m=(0.0, 0.74), radius_m=0.6, velocity_mps=(0.8, -0.05))
    slow = RiskParams(fast_margin_s=0.0, fast_close_s=0.0)
    world = TrajectoryCost((0.0, 0.0), [beside], slow, 0.1, 0.8)
    candidates = [(5.0, (1.0, 0.0), 1.25, 0), (5.0, (2.0, 0.0), 2.5, 0)]
    found = world.cheapest(candidates, (5.0, 0.0), 0.8, 5.06)
    assert found is not None
    assert found[0] == (2.0, 0.0)


def test_a_circle_at_the_far_end_of_a_candidate_is_not_left_out() -> None:
    """A path beyond the goal and back with a cost near the bound, and a circle behind the goal."""
    behind = Circle(center_m=(2.05, 0.0), radius_m=0.6)
    world = TrajectoryCost((0.0, 0.0), [behind], RiskParams(), 0.1, 0.8)
    candidates = [(-math.inf, (0.0, 2.0), 2.5, -1), (2.0, (1.5, 0.0), 1.875, 0)]
    assert world.cheapest(candidates, (1.0, 0.0), 0.8, 2.1) is None


@pytest.mark.parametrize(
    ("center", "velocity"),
    [
        ((-0.28421218099083234, -1.865418235683447), (-0.36571976703050657, -0.7115118073532948)),
        ((-1.7917194255901954, -0.7333067010725125), (-0.7978479167438711, -0.058640444639045754)),
        ((0.20929865995889174, 1.7257496037770959), (0.3645074657187967, 0.7121336303217678)),
    ],
)
def test_a_circle_touched_to_the_last_bit_is_evaluated_like_any_other(
    center: Point, velocity: Point
) -> None:
    """The rounding decides whether the closest approach is a contact."""
    world = TrajectoryCost((0.0, 0.0), [Circle(center_m=center, radius_m=0.6)], RiskParams(), 0.1)
    waypoint = (2.5 * velocity[0], 2.5 * velocity[1])
    assert 2.0 < world.cost(waypoint, 2.5, waypoint, 0.8) < math.inf
