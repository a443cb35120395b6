# SPDX-License-Identifier: Apache-2.0
"""The core driver and the metrics of a run: worked examples, and both case studies."""

import math
from dataclasses import replace
from typing import Any

import pytest
from trip_samples import post, trip

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Mode, Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import Result, evaluate, tick_clearances
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode, Outcome, stamp_of
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.planner_observations import sense
from mfba_planner.simulation.robot_model import Robot
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.world import World, advance
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams

STRAIGHT = 12.0 * math.sqrt(2.0)  # 16.9706 m
TASK: dict[str, Any] = {"name": "x", "start_m": (0.0, 0.0), "goal_m": (4.0, 0.0)}


# --- the robot ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"robot_radius_m": 0.5}, r"planner.robot_radius_m 0.3: the scenario's robot has 0.5"),
        (
            {"robot": Robot(drive=Drive.DIFFERENTIAL)},
            "planner.drive Drive.OMNIDIRECTIONAL: the scenario's robot has Drive.DIFFERENTIAL",
        ),
    ],
)
def test_a_planner_for_another_robot_is_refused(change: dict[str, Any], reason: str) -> None:
    scenario = Scenario(**TASK, **change)
    with pytest.raises(ConfigError, match=reason):
        run(scenario, planner=PlannerParams(), path_planner=Algorithm1(PlannerParams(), 0))
    own = scenario.planner_params(PlannerParams())
    assert run(scenario, planner=own, path_planner=Algorithm1(own, 0)).planner == own
    assert run(scenario).planner == own, "without a planner of one's own"


# --- the world --------------------------------------------------------------------------------


def test_stamps_start_at_one_tick() -> None:
    assert [stamp_of(k, 250) for k in (0, 1, 2)] == [250, 500, 750]


def test_advance_keeps_yaw_and_moves_by_velocity_times_time() -> None:
    assert advance(Pose2D(1.0, 2.0, 3.0), (2.0, -4.0), 500_000_000) == Pose2D(2.0, 0.0, 3.0)


def test_a_world_step_by_step() -> None:
    moving = Obstacle(center_m=(0.0, 5.0), radius_m=0.5, speed_mps=1.0, heading_rad=0.0)
    scenario = Scenario(**TASK, obstacles=(moving,))
    world = World(scenario, 500_000_000, 0.25)
    assert (world.tick, world.stamp_ns, world.time_s) == (0, 500_000_000, 0.0)
    assert world.pose == Pose2D(0.0, 0.0, 0.0)
    world.step((1.0, 2.0))
    assert (world.tick, world.stamp_ns, world.time_s) == (1, 1_000_000_000, 0.5)
    assert world.pose == Pose2D(0.5, 1.0, 0.0)
    world.step((1.0, 6.0))
    assert world.time_s == 1.0
    assert world.pose == Pose2D(1.0, 4.0, 0.0)
    params = SensorParams(sensing_range_m=0.4)
    assert sense(world, params) == sense_circles((1.0, 4.0), [((1.0, 5.0), 0.8)], params)
    assert math.isfinite(min(sense(world, params)))


def test_a_world_ends_at_the_goal_or_at_the_time_limit() -> None:
    scenario = Scenario(**TASK, time_limit_s=3.0)
    world = World(scenario, 1_000_000_000, 0.25)
    assert world.outcome() is None
    world.step((3.7499, 0.0))
    assert world.outcome() is None
    world.step((0.0001, 0.0))
    assert world.outcome() is Outcome.GOAL_REACHED, "the tolerance includes its edge"
    world.step((-1.0, 0.0))
    assert world.outcome() is Outcome.TIME_LIMIT, "3 s are not less than 3 s"
    world.step((1.0, 0.0))
    assert world.outcome() is Outcome.GOAL_REACHED, "the goal counts, if late"


# --- the driver -------------------------------------------------------------------------------


def test_the_driver_senses_decides_moves() -> None:
    scenario = load_scenario("case1")
    params, sensor = PlannerParams(speed_mps=0.7), SensorParams(sectors=8)
    episode = run(scenario, planner=params, sensor=sensor, seed=3)
    assert (episode.scenario, episode.planner, episode.sensor) == (scenario, params, sensor)
    assert (episode.seed, episode.driver) == (3, "core")
    path_planner, pose = Algorithm1(params, 3), Pose2D(0.0, 0.0)
    for k, tick in enumerate(episode.ticks):
        stamp, t = (k + 1) * params.tick_ns, k * params.tick_ns * 1e-9
        ranges = sense_circles(pose.position, scenario.enlarged(t), sensor)
        assert tick == path_planner.plan(
            Observation(
                stamp_ns=stamp, now_ns=stamp, pose=pose, ranges_m=ranges, goal=(12.0, 12.0)
            )
        )
        assert episode.time_s(tick.stamp_ns) == t
        pose = advance(pose, tick.velocity, params.tick_ns)
    assert episode.ticks[-1].mode is Mode.ARRIVED
    assert episode.outcome is Outcome.GOAL_REACHED


def test_the_defaults_are_those_of_section_6_2() -> None:
    scenario = load_scenario("empty")
    episode = run(scenario)
    assert episode == run(scenario, planner=PlannerParams(), sensor=SensorParams(), seed=0)
    plain = Episode(scenario=scenario, seed=0, driver="x", ticks=(), outcome=Outcome.INTERRUPTED)
    assert (plain.planner, plain.sensor) == (PlannerParams(), SensorParams())


def test_equal_seeds_give_equal_episodes() -> None:
    scenario = load_scenario("case2")
    assert run(scenario, seed=4) == run(scenario, seed=4)
    assert run(scenario, seed=4).ticks != run(scenario, seed=5).ticks


def test_without_obstacles_the_path_is_nearly_straight() -> None:
    lengths = []
    for seed in range(20):
        episode = run(load_scenario("empty"), seed=seed)
        result = evaluate(episode)
        lengths.append(result.length_m)
        assert result.success
        assert [tick.mode for tick in episode.ticks[:-1]] == [Mode.PATH_GENERATION] * (
            result.ticks - 1
        )
        assert result.mode_switches == 1, "the arrival"
        assert (result.encounters, result.min_clearance_m) == ((), math.inf)
    assert min(lengths) >= STRAIGHT - 0.02, "less the tolerance"
    assert max(lengths) < STRAIGHT * 1.01


def test_a_goal_behind_an_obstacle_that_cannot_be_entered_ends_at_the_time_limit() -> None:
    for center in ((4.0, 0.0), (4.0, 0.1)):
        scenario = Scenario(**TASK, obstacles=(post(center),), time_limit_s=20.0)
        episode = run(scenario, seed=1)
        assert episode.outcome is Outcome.TIME_LIMIT
        last = episode.time_s(episode.ticks[-1].stamp_ns)
        assert 20.0 <= last < 20.0 + PlannerParams().tick_ns * 1e-9
        result = evaluate(episode)
        assert not result.success
        assert result.collisions == 0


def test_a_robot_that_is_walled_in_stands_until_the_time_limit() -> None:
    ring = tuple(
        post((1.3 * math.cos(a), 1.3 * math.sin(a)))
        for a in [math.radians(30.0 * k) for k in range(12)]
    )
    episode = run(Scenario(**TASK, obstacles=ring, time_limit_s=2.0))
    result = evaluate(episode)
    assert result.outcome is Outcome.TIME_LIMIT
    assert {tick.mode for tick in episode.ticks} == {Mode.BLOCKED}
    assert (result.length_m, result.fitness) == (0.0, math.inf)
    assert result.blocked_ticks == result.ticks == 7
    assert result.min_clearance_m == pytest.approx(1.3 - 0.8)


def test_a_start_within_the_tolerance_of_the_goal_is_an_arrival() -> None:
    episode = run(Scenario(name="x", start_m=(0.0, 0.0), goal_m=(0.01, 0.0)))
    assert [tick.mode for tick in episode.ticks] == [Mode.ARRIVED]
    assert episode.outcome is Outcome.GOAL_REACHED
    assert evaluate(episode).success
    assert evaluate(episode).time_s == 0.0


def test_go_on_ends_a_run() -> None:
    ticks = []

    def go_on(world: World) -> bool:
        ticks.append(world.tick)
        return world.tick < 5

    episode = run(load_scenario("case1"), go_on=go_on)
    assert ticks == [0, 1, 2, 3, 4, 5]
    assert len(episode.ticks) == 6
    assert episode.outcome is Outcome.INTERRUPTED
    assert not evaluate(episode).success


# --- hand-made episodes -----------------------------------------------------------------------

PG, OA = Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE


def test_a_trip_by_hand() -> None:
    modes = [PG, OA, OA, PG, Mode.BLOCKED, Mode.STOPPED, Mode.BLOCKED, Mode.ARRIVED]
    points = [(0.0, 0.0), (3.0, 4.0), (3.0, 5.0), *[(3.0, 7.0)] * 5]
    assert evaluate(trip(points, modes, (post((3.0, 9.5)),))) == Result(
        outcome=Outcome.GOAL_REACHED,
        success=True,
        length_m=8.0,
        time_s=7.0,
        ticks=8,
        fitness=0.125,
        min_clearance_m=2.5 - 0.8,
        collisions=0,
        mode_switches=6,
        avoidance_ticks=2,
        blocked_ticks=2,
        stopped_ticks=1,
        encounters=(),
    )


def test_fitness_is_the_reciprocal_length_of_tables_5_and_7() -> None:
    assert evaluate(trip([(0.0, 0.0), (17.0932, 0.0)])).fitness == pytest.approx(
        0.0585028, abs=1e-7
    )
    assert evaluate(trip([(0.0, 0.0), (18.3533, 0.0)])).fitness == pytest.approx(
        0.0544861, abs=1e-7
    )


def test_fitness_of_a_very_short_trip() -> None:
    assert evaluate(trip([(0.0, 0.0), (0.0, 0.5)])).fitness == 2.0


@pytest.mark.parametrize("count", [0, 1])
def test_an_episode_without_a_step(count: int) -> None:
    result = evaluate(trip([(1.0, 2.0)] * count, obstacles=(post((1.0, 5.0)),)))
    assert (result.ticks, result.time_s, result.length_m) == (count, 0.0, 0.0)
    assert result.fitness == math.inf
    assert result.min_clearance_m == (pytest.approx(3.0 - 0.8) if count else math.inf)
    assert result.mode_switches == 0


def test_clearances_per_step_and_obstacle() -> None:
    runner = Obstacle(center_m=(2.0, -2.0), radius_m=0.5, speed_mps=1.0, heading_rad=math.pi / 2)
    episode = trip([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], obstacles=(post((1.0, 2.0)), runner))
    first, second = tick_clearances(episode)
    assert first == pytest.approx([2.0 - 0.8, math.sqrt(2.0) - 0.8])
    assert second == pytest.approx([2.0 - 0.8, -0.8])
    result = evaluate(episode)
    assert result.min_clearance_m == pytest.approx(-0.8)
    assert (result.collisions, result.success) == (1, False)


def test_the_first_step_starts_at_t_0() -> None:
    runner = Obstacle(center_m=(0.0, 2.0), radius_m=0.5, speed_mps=1.0, heading_rad=0.0)
    episode = trip([(0.0, 0.0)] * 2, obstacles=(runner,))
    assert tick_clearances(episode) == [[2.0 - 0.8]]


def test_two_contacts_with_one_obstacle_are_two_collisions() -> None:
    through = [(0.0, 0.0), (2.0, 0.0), (4.0, 0.0)]  # through the post in both steps
    episode = trip([*through, (6.0, 0.0), (4.0, 0.0), (2.0, 0.0)], obstacles=(post((2.0, 0.0)),))
    assert [row[0] < 0.0 for row in tick_clearances(episode)] == [True, True, False, False, True]
    assert evaluate(episode).collisions == 2


def test_each_obstacle_in_contact_counts() -> None:
    posts = (post((2.0, 0.3)), post((2.0, -0.3)), post((9.0, 1.0)))
    assert evaluate(trip([(0.0, 0.0), (4.0, 0.0)], obstacles=posts)).collisions == 2


def test_touching_is_not_a_collision() -> None:
    for radius, collisions in ((0.5, 0), (0.5 + 1e-10, 0), (0.5 + 1e-8, 1)):
        beside = post((2.0, 0.8), radius)
        result = evaluate(trip([(0.0, 0.0), (4.0, 0.0)], obstacles=(beside,)))
        assert (result.collisions, result.success) == (collisions, not collisions)


@pytest.mark.parametrize("outcome", [Outcome.TIME_LIMIT, Outcome.INTERRUPTED])
def test_success_needs_the_goal(outcome: Outcome) -> None:
    result = evaluate(trip([(0.0, 0.0), (1.0, 0.0)], outcome=outcome))
    assert (result.success, result.outcome) == (False, outcome)


def test_run_refuses_other_methods_than_the_papers() -> None:
    params = PlannerParams(method=Method.PREDICTIVE)
    with pytest.raises(ConfigError, match="method=predictive: not Algorithm 1"):
        run(load_scenario("case1"), planner=params)


def test_encounters_are_sorted_by_time() -> None:
    # SR 0.8 from the enlarged edge: 1.6 m from a centre
    posts = (post((6.0, 1.6)), post((3.0, -1.5)), post((0.0, 1.6000001)), post((6.0, -1.0)))
    episode = trip([(0.0, 0.0), (3.0, 0.0), (6.0, 0.0), (3.0, 0.0)], obstacles=posts)
    assert evaluate(episode).encounters == (2, 1, 4)
    wide = replace(episode, sensor=SensorParams(sensing_range_m=0.81))
    assert evaluate(wide).encounters == (3, 2, 1, 4)


def test_encounters_follow_moving_obstacles() -> None:
    runner = Obstacle(center_m=(0.0, 4.0), radius_m=0.5, speed_mps=1.0, heading_rad=-math.pi / 2)
    assert evaluate(trip([(0.0, 0.0)] * 3, obstacles=(runner,))).encounters == ()
    assert evaluate(trip([(0.0, 0.0)] * 4, obstacles=(runner,))).encounters == (1,)


def test_lengths_do_not_depend_on_how_python_sums() -> None:
    points = [(0.1 * k, 0.0) for k in range(1001)]
    assert evaluate(trip(points)).length_m == math.fsum(
        math.sqrt((b[0] - a[0]) ** 2) for a, b in zip(points, points[1:])
    )


# --- both case studies ------------------------------------------------------------------------


@pytest.mark.no_cover
@pytest.mark.parametrize("algorithm", Algorithm)
@pytest.mark.parametrize(
    ("name", "shortest", "longest", "median", "first"),
    [("case1", 17.04, 17.5, 17.12, {1}), ("case2", 18.2, 21.0, 18.5, {1})],
)
def test_200_seeds_reach_the_goal_without_collision(
    name: str,
    shortest: float,
    longest: float,
    median: float,
    first: set[int],
    algorithm: Algorithm,
) -> None:
    scenario = load_scenario(name)
    params = PlannerParams(bat=BatParams(algorithm=algorithm))
    results = [evaluate(run(scenario, planner=params, seed=seed)) for seed in range(200)]
    assert all(result.success for result in results)
    assert all(result.outcome is Outcome.GOAL_REACHED for result in results)
    lengths = sorted(result.length_m for result in results)
    assert shortest < lengths[0]
    assert lengths[-1] < longest
    assert lengths[100] == pytest.approx(median, abs=0.08)
    assert min(result.min_clearance_m for result in results) > 0.05
    assert {result.encounters[0] for result in results} == first
    assert all(result.avoidance_ticks > 0 for result in results)
