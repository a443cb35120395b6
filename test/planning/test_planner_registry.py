# SPDX-License-Identifier: Apache-2.0
"""Planners by name, their simulated observations, and stop conditions common to all."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.core.planner_types import Mode, Observation
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.peers.straight_line import Straight
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.planner_registry import PLANNERS, make
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle, Walls, center_at, velocity_at
from mfba_planner.simulation.planner_observations import Perception
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.simulated_lidar import cast_rays
from mfba_planner.simulation.world import World

PARAMS = PlannerParams(speed_mps=0.8, step_length_m=0.2)
SENSOR = SensorParams()
INF12 = (math.inf,) * 12
OURS = sorted(set(PLANNERS) - {"paper", "ba", "mfba"})


def observation(**changes: object) -> Observation:
    plain = Observation(
        stamp_ns=10**9,
        now_ns=10**9,
        pose=Pose2D(1.0, 2.0),
        ranges_m=INF12,
        goal=(9.0, 8.0),
        circles=(),
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


def world_with(*obstacles: Obstacle, walls: Walls | None = None) -> World:
    scenario = Scenario(
        name="w", start_m=(5.0, 5.0), goal_m=(9.0, 9.0), obstacles=obstacles, walls=walls
    )
    return World(scenario, PARAMS.tick_ns, 0.02)


def test_the_error_for_an_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(ConfigError, match="'straigt': unknown; did you mean 'straight'"):
        make("straigt")
    with pytest.raises(ConfigError, match="'scan12': unknown; did you mean 'scan-12'"):
        Perception("scan12")


@pytest.mark.parametrize("name", sorted(PLANNERS))
def test_negative_seeds_are_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="seed=-1: negative"):
        make(name, seed=-1)


@pytest.mark.parametrize(
    "arguments", [{"noise_m": -0.1}, {"noise_m": math.nan}, {"latency_ticks": -1}, {"seed": -2}]
)
def test_impossible_perceptions_are_refused(arguments: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="give"):
        Perception("known", **arguments)  # type: ignore[arg-type]


def test_paper_and_mfba_equal_algorithm_1_bit_by_bit_and_ba_differs() -> None:
    case1 = load_scenario("case1")
    plain = digest(run(case1, seed=3).ticks)
    assert digest(run(case1, seed=3, path_planner=make("paper", seed=3)).ticks) == plain
    assert digest(run(case1, seed=3, path_planner=make("mfba", seed=3)).ticks) == plain
    assert digest(run(case1, seed=3, path_planner=make("ba", seed=3)).ticks) != plain


def test_straight_is_the_straight_line() -> None:
    case1 = load_scenario("case1")
    result = evaluate(run(case1, planner=PARAMS, path_planner=make("straight", PARAMS)))
    assert result.outcome is Outcome.GOAL_REACHED
    assert result.length_m == pytest.approx(12.0 * math.sqrt(2.0), abs=PARAMS.goal_tolerance_m)


@pytest.mark.parametrize("name", OURS)
@pytest.mark.parametrize(
    ("changes", "mode", "reason"),
    [
        ({"pose": Pose2D(math.nan, 0.0)}, Mode.STOPPED, "refused input: pose"),
        ({"goal": (math.inf, 0.0)}, Mode.STOPPED, "refused input: goal"),
        ({"refused": "odom garbled"}, Mode.STOPPED, "refused input: odom garbled"),
        ({"now_ns": 3 * 10**9}, Mode.STOPPED, "input is 2.000 s old"),
        ({"goal": None}, Mode.IDLE, "no goal given"),
        ({"goal": (1.0, 2.01)}, Mode.ARRIVED, "goal reached"),
    ],
)
def test_every_planner_stops_for_the_same_reasons(
    name: str, changes: dict[str, object], mode: Mode, reason: str
) -> None:
    planner = make(name, PARAMS)
    decision = planner.plan(observation(**changes))
    assert (decision.mode, decision.velocity) == (mode, (0.0, 0.0))
    assert decision.reason.startswith(reason)


@pytest.mark.parametrize("name", OURS)
def test_arrival_lasts_until_a_new_goal(name: str) -> None:
    planner = make(name, PARAMS)
    planner.plan(observation(goal=(1.0, 2.0)))
    pushed = planner.plan(
        observation(goal=(1.0, 2.0), pose=Pose2D(3.0, 2.0), stamp_ns=2 * 10**9, now_ns=2 * 10**9)
    )
    assert (pushed.mode, pushed.velocity) == (Mode.ARRIVED, (0.0, 0.0))
    again = planner.plan(observation(stamp_ns=3 * 10**9, now_ns=3 * 10**9))
    assert again.mode is Mode.PATH_GENERATION
    assert math.hypot(*again.velocity) == pytest.approx(PARAMS.speed_mps)


@pytest.mark.parametrize("name", OURS)
def test_the_last_step_ends_at_the_goal(name: str) -> None:
    decision = make(name, PARAMS).plan(observation(goal=(1.1, 2.05)))
    assert decision.waypoint == pytest.approx((1.1, 2.05))


def test_known_circles_are_those_within_sr_with_their_present_velocity() -> None:
    near = Obstacle(center_m=(6.3, 5.0), radius_m=0.3, speed_mps=0.2, heading_rad=math.pi)
    far = Obstacle(center_m=(6.5, 5.0), radius_m=0.3)
    visible = Perception("known")(world_with(near, far), SENSOR)
    assert visible.circles is not None
    (circle,) = visible.circles
    assert circle.center_m == pytest.approx((6.3, 5.0))
    assert circle.radius_m == pytest.approx(0.6)
    assert circle.velocity_mps == pytest.approx((-0.2, 0.0))
    assert visible.sensed is None


@given(
    t=st.floats(0.0, 500.0),
    heading=st.floats(0.0, 2.0 * math.pi),
    speed=st.floats(0.05, 2.0),
)
def test_velocity_at_is_the_derivative_of_center_at(
    t: float, heading: float, speed: float
) -> None:
    walls = Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 5.0))
    obstacle = Obstacle(center_m=(4.0, 2.0), radius_m=0.3, speed_mps=speed, heading_rad=heading)
    vx, vy = velocity_at(obstacle, t, walls)
    h = 1e-4
    (ax, ay), (bx, by) = (center_at(obstacle, t + s, walls) for s in (0.0, h))
    for v, a, b, low, high in ((vx, ax, bx, 0.3, 11.7), (vy, ay, by, 0.3, 4.7)):
        if min(a, b) - low > 2 * h * speed and high - max(a, b) > 2 * h * speed:
            assert v == pytest.approx((b - a) / h, abs=1e-6)


@given(
    bearing_rad=st.floats(-math.pi, math.pi), d=st.floats(0.31, 3.0), radius=st.floats(0.05, 0.3)
)
def test_beams_end_on_surfaces_and_miss_no_wide_obstacle(
    bearing_rad: float, d: float, radius: float
) -> None:
    x, y = d * math.cos(bearing_rad), d * math.sin(bearing_rad)
    ranges = cast_rays((0.0, 0.0), [(x, y, radius)], 360, 1.1)
    angles = (np.arange(360) + 0.5) * (2.0 * math.pi / 360)
    hit = np.isfinite(ranges)
    points = ranges[hit] * np.cos(angles[hit]), ranges[hit] * np.sin(angles[hit])
    assert np.allclose(np.hypot(points[0] - x, points[1] - y), radius)
    assert (ranges[hit] <= 1.1).all()
    off = np.abs(np.remainder(angles - bearing_rad + math.pi, 2.0 * math.pi) - math.pi)
    into = d * np.cos(off) - np.sqrt(np.maximum(radius**2 - (d * np.sin(off)) ** 2, 0.0))
    meets = (off < math.asin(radius / d) - 1e-6) & (into < 1.1 - 1e-6)
    assert hit[meets].all()


def test_a_scan_reaches_as_far_as_the_sensing_region() -> None:
    edge = 5.0 + SENSOR.sensing_range_m + 0.6
    for centre, visible in ((edge - 1e-3, True), (edge + 1e-3, False)):
        world = world_with(Obstacle(center_m=(centre, 5.0), radius_m=0.3))
        scan = Perception("scan-360")(world, SENSOR).scan
        assert scan is not None
        # The nearest beams pass half a degree beside the circle's nearest point.
        assert bool(np.isfinite(scan.ranges_m).any()) is visible
        circles = Perception("known")(world, SENSOR).circles
        assert circles is not None
        assert bool(circles) is visible


@pytest.mark.parametrize("name", ["known", "scan-12", "scan-360"])
def test_latency_gives_older_sensor_data_with_its_stamp_and_pose(name: str) -> None:
    obstacle = Obstacle(center_m=(6.0, 5.0), radius_m=0.3, speed_mps=0.3, heading_rad=1.0)
    late, prompt = Perception(name, latency_ticks=2), Perception(name)
    world = world_with(obstacle)
    prompt_obs, late_obs = [], []
    for _ in range(4):
        prompt_obs.append(prompt(world, SENSOR))
        late_obs.append(late(world, SENSOR))
        world.step((0.1, 0.0))
    for k, n in enumerate([0, 0, 0, 1]):
        assert late_obs[k].pose == prompt_obs[k].pose
        assert late_obs[k].stamp_ns == prompt_obs[k].stamp_ns
        assert late_obs[k].circles == prompt_obs[n].circles
        assert (late_obs[k].sensed is None) is (k == 0)
        if k:
            assert late_obs[k].sensed == (prompt_obs[n].stamp_ns, prompt_obs[n].pose)
        then, now_scan = prompt_obs[n].scan, late_obs[k].scan
        if then is not None and now_scan is not None:
            assert np.array_equal(then.ranges_m, now_scan.ranges_m)
    restarted = late(world_with(obstacle), SENSOR)
    assert restarted.sensed is None


@pytest.mark.parametrize("name", ["known", "scan-360"])
def test_noise_depends_on_the_seed_and_has_the_given_deviation(name: str) -> None:
    world = world_with(Obstacle(center_m=(6.0, 5.0), radius_m=0.3))

    def errors(seed: int) -> list[float]:
        observer = Perception(name, noise_m=0.02, seed=seed)
        found, true = observer(world, SENSOR), Perception(name)(world, SENSOR)
        if found.circles is not None and true.circles is not None:
            pairs = zip(found.circles[0].center_m, true.circles[0].center_m)
            return [a - b for a, b in pairs]
        assert found.scan is not None
        assert true.scan is not None
        both = np.isfinite(found.scan.ranges_m) & np.isfinite(true.scan.ranges_m)
        return (found.scan.ranges_m[both] - true.scan.ranges_m[both]).tolist()

    assert errors(1) == errors(1) != errors(2)
    drawn = [e for seed in range(100) for e in errors(seed)]
    assert float(np.std(drawn)) == pytest.approx(0.02, rel=0.2)


def test_a_scan_gives_the_paper_s_planner_its_sectors() -> None:
    case1 = load_scenario("case1")
    episode = run(
        case1, planner=PARAMS, path_planner=make("paper", PARAMS), observe=Perception("scan-360")
    )
    assert evaluate(episode).success
    blind = Perception("scan-12", sectors=False)
    assert (
        run(
            case1,
            planner=PARAMS,
            path_planner=make("paper", PARAMS),
            observe=blind,
            go_on=lambda _: False,
        )
        .ticks[0]
        .mode
        is Mode.STOPPED
    )


def test_a_velocity_beyond_the_goal_is_reduced() -> None:
    straight = Straight(PARAMS, SENSOR, 0)
    velocity = straight.straight((0.0, 0.0), (0.05, 0.0), 0.8)
    assert distance((0.0, 0.0), velocity) * PARAMS.tick_ns * 1e-9 == pytest.approx(0.05)
