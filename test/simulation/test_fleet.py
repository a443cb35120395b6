# SPDX-License-Identifier: Apache-2.0
"""Fleets: what robots observe of each other, contacts between them, reproducibility by seed."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner import cli
from mfba_planner.core.errors import BagError, ConfigError
from mfba_planner.core.geometry import Point, Pose2D, closest_approach, distance
from mfba_planner.core.planner_types import Decision, Mode, Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import evaluate, tick_clearances
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.planner_registry import make
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.planning.speed_limit import SpeedLimitParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.read_episode import read_episode, read_recording
from mfba_planner.report.result_json import read_result
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.fleet import (
    Fleet,
    path_as_obstacle,
    robot_seed,
    run_fleet,
    single_robot_scenario,
)
from mfba_planner.simulation.obstacle_motion import Obstacle, Walls, center_at
from mfba_planner.simulation.planner_observations import Perception
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import run, simulate_fleet
from mfba_planner.simulation.scenario import FleetRobot, Kidnapping, Scenario
from mfba_planner.simulation.world import World

TICK_NS = PlannerParams().tick_ns


def fleet_of(*ends: tuple[Point, Point], **more: Any) -> Scenario:
    """Robots a, b, ... with these starts and goals."""
    members = tuple(
        FleetRobot(name=chr(ord("a") + k), start_m=start, goal_m=goal)
        for k, (start, goal) in enumerate(ends)
    )
    start, goal = ends[0]
    return Scenario(name="fleet", start_m=start, goal_m=goal, robots=members, **more)


def head_on(**more: Any) -> Scenario:
    return fleet_of(((-4.0, 0.0), (4.0, 0.0)), ((4.0, 0.0), (-4.0, 0.0)), **more)


class Blind:
    """Drives straight to its goal and ignores obstacles, 1.5 m per tick."""

    def __init__(self, seed: int) -> None:
        self.inner = make("straight", PlannerParams(step_length_m=1.5), seed=seed)

    def plan(self, obs: Observation) -> Decision:
        return self.inner.plan(replace(obs, ranges_m=(math.inf,) * 12))


@pytest.mark.parametrize("seed", range(3))
def test_two_robots_head_on_pass_each_other(seed: int) -> None:
    planner = preset(PlannerParams(method=Method.PREDICTIVE))
    done = simulate_fleet(head_on(), planner=planner, sensor=SensorParams(), seed=seed)
    for episode in done:
        result = evaluate(episode)
        assert result.success
        assert result.encounters == (1,)


def test_algorithm_1_head_on_never_touches_but_may_go_on_side_by_side() -> None:
    """Two robots that avoid to the same side stay side by side at every tick."""
    results = [evaluate(e) for seed in range(6) for e in run_fleet(head_on(), seed=seed)]
    assert not any(result.collisions for result in results)
    assert {result.outcome for result in results} == {Outcome.GOAL_REACHED, Outcome.TIME_LIMIT}


def test_ten_robots_swap_places_on_the_shipped_circle() -> None:
    scenario = load_scenario("swap")
    done = run_fleet(scenario, seed=1)
    assert [episode.scenario.name for episode in done][:2] == ["swap.robot0", "swap.robot1"]
    for member, episode in zip(scenario.robots, done, strict=True):
        assert evaluate(episode).success
        assert distance(episode.ticks[0].pose.position, member.start_m) == 0.0
        assert distance(episode.ticks[-1].pose.position, member.goal_m) <= 0.02
        assert episode.ticks[-1].mode is Mode.ARRIVED


def test_a_contact_between_two_ticks_counts_for_both() -> None:
    """They swap positions within one tick: apart at every tick, in contact between."""
    scenario = fleet_of(((-0.7, 0.0), (3.0, 0.0)), ((0.7, 0.0), (-3.0, 0.0)))
    params = PlannerParams(step_length_m=1.5)
    done = run_fleet(scenario, planner=params, path_planner=Blind)
    for mine, other in zip(done, done[::-1]):
        assert all(distance(a.pose.position, b.pose.position) > 0.6
                   for a, b in zip(mine.ticks, other.ticks))  # fmt: skip
        result = evaluate(mine)
        assert result.collisions == 1
        assert result.min_clearance_m == pytest.approx(-0.6, abs=1e-9)
        assert result.outcome is Outcome.GOAL_REACHED
        assert not result.success


def test_an_arrived_robot_remains_an_obstacle() -> None:
    scenario = fleet_of(((1.5, 0.0), (2.0, 0.0)), ((-4.0, 0.0), (6.0, 0.0)))
    near, far = run_fleet(scenario, path_planner=Blind, planner=PlannerParams(step_length_m=1.5))
    assert len(near.ticks) < len(far.ticks)
    assert evaluate(far).collisions == 1
    assert evaluate(near).collisions == 0  # its own run had ended


def test_obstacles_keep_moving_around_an_arrived_robot() -> None:
    obstacle = Obstacle(center_m=(2.0, 0.0), radius_m=0.3, speed_mps=0.2, heading_rad=1.0)
    ends = (((0.0, 0.0), (0.3, 0.0)), ((0.0, 5.0), (8.0, 5.0)))
    fleet = Fleet(fleet_of(*ends, obstacles=(obstacle,)), TICK_NS, 0.01, 0)
    fleet.step({0: (0.3 / (TICK_NS * 1e-9), 0.0), 1: (0.1, 0.0)})
    assert fleet.running == [1]
    for _ in range(3):
        fleet.step({1: (0.1, 0.0)})
    arrived = fleet.robot_worlds[0]
    assert arrived.tick == fleet.tick == 4
    _, circles = arrived.near(10.0)
    assert circles[0][0] == pytest.approx(center_at(obstacle, 4 * TICK_NS * 1e-9))


def test_other_robots_are_obstacles_along_their_paths() -> None:
    done = run_fleet(load_scenario("swap"), seed=2)
    for episode in done:
        others = [e for e in done if e is not episode]
        for obstacle, other in zip(episode.scenario.obstacles, others, strict=True):
            for tick in other.ticks:
                center = center_at(obstacle, other.time_s(tick.stamp_ns))
                assert distance(center, tick.pose.position) < 1e-9
            last_s = other.time_s(other.ticks[-1].stamp_ns)
            assert (
                distance(center_at(obstacle, last_s + 50.0), other.ticks[-1].pose.position) < 1e-9
            )
        gaps = tick_clearances(episode)
        for k, (a, b) in enumerate(zip(episode.ticks, episode.ticks[1:])):
            for gap, other in zip(gaps[k], others):
                if k + 1 < len(other.ticks):
                    c, d = other.ticks[k], other.ticks[k + 1]
                    apart = closest_approach(
                        a.pose.position, b.pose.position, c.pose.position, d.pose.position
                    )
                    assert gap == pytest.approx(apart - 0.6, abs=1e-9)
        result = evaluate(episode)
        assert result.min_clearance_m == pytest.approx(min(map(min, gaps)), abs=1e-12)


def test_every_robot_of_a_fleet_senses_and_touches_the_walls() -> None:
    """Two robots side by side, a wall before one of them, as in its own world."""
    ends = (((0.0, 0.0), (6.0, 0.0)), ((0.0, 4.0), (6.0, 4.0)))
    walls = ((3.0, 3.5, 3.0, 4.2),)
    free, walled = run_fleet(fleet_of(*ends, segments_m=walls), seed=1)
    assert free.scenario.segments_m == walled.scenario.segments_m == walls
    assert not any(any(tick.vs) for tick in free.ticks)
    assert any(any(tick.vs) for tick in walled.ticks)
    assert evaluate(walled).min_clearance_m < 1.0 < evaluate(free).min_clearance_m
    through = run_fleet(fleet_of(*ends, segments_m=walls), path_planner=Blind)
    assert [evaluate(episode).collisions for episode in through] == [0, 1]


def test_an_episode_of_a_fleet_can_be_run_again() -> None:
    """Run again as a single robot among obstacles, it decides the same."""
    for episode in run_fleet(head_on(), seed=3):
        text = scenario_to_json(episode.scenario)
        assert load_scenario(text) == episode.scenario
        again = run(episode.scenario, seed=episode.seed)
        assert digest(again.ticks) == digest(episode.ticks)


def test_equal_seeds_give_equal_decisions_and_robots_have_own_seeds() -> None:
    scenario = load_scenario("swap")
    first, same, other = (run_fleet(scenario, seed=seed) for seed in (5, 5, 6))
    assert [digest(e.ticks) for e in first] == [digest(e.ticks) for e in same]
    assert [digest(e.ticks) for e in first] != [digest(e.ticks) for e in other]
    assert len({robot_seed(seed, n) for seed in range(50) for n in range(10)}) == 500
    assert all(0 <= robot_seed(seed, n) < 2**63 for seed in range(50) for n in range(10))


def test_a_fleet_of_one_equals_a_single_robot() -> None:
    case = load_scenario("case1")
    only = FleetRobot(name="a", start_m=case.start_m, goal_m=case.goal_m)
    (episode,) = run_fleet(replace(case, robots=(only,)), seed=4)
    assert digest(episode.ticks) == digest(run(case, seed=robot_seed(4, 0)).ticks)


def test_obstacles_and_robots_are_observed_alike() -> None:
    still = Obstacle(center_m=(0.0, 1.0), radius_m=0.2)
    scenario = fleet_of(((0.0, 0.0), (9.0, 0.0)), ((1.0, 0.0), (9.0, 5.0)), obstacles=(still,))
    fleet = Fleet(scenario, TICK_NS, 0.02)
    first, second = fleet.robot_worlds
    assert first.near(3.0)[1] == [((0.0, 1.0), 0.5), ((1.0, 0.0), 0.6)]
    assert second.near(3.0)[1] == [((0.0, 1.0), 0.5), ((0.0, 0.0), 0.6)]
    assert [first.radius_m(k) for k in (0, 1)] == [0.2, 0.3]
    assert first.velocity(1) == (0.0, 0.0)
    fleet.step({0: (0.0, 0.0), 1: (0.5, -0.25)})
    assert first.velocity(1) == pytest.approx((0.5, -0.25))
    assert second.velocity(1) == (0.0, 0.0)
    obs = Perception("known")(first, SensorParams())
    assert obs.circles is not None
    assert [c.velocity_mps for c in obs.circles] == [(0.0, 0.0), first.velocity(1)]


@pytest.mark.parametrize("beams", [0, 360])
def test_a_lidar_detects_the_other_robots(beams: int) -> None:
    scenario = fleet_of(((0.0, 0.0), (9.0, 0.0)), ((1.5, 0.0), (9.0, 5.0)),
                        robot=Robot(lidar=Lidar(beams=beams)))  # fmt: skip
    scan = Fleet(scenario, TICK_NS, 0.02).robot_worlds[0].read().scan
    assert (scan is None) == (beams == 0)
    if scan is not None:
        assert float(min(scan.ranges_m)) == pytest.approx(1.2, abs=1e-3)


def test_differential_robots_with_lidars_share_a_world() -> None:
    robot = Robot(drive=Drive.DIFFERENTIAL, lidar=Lidar(beams=180))
    scenario = replace(head_on(), robot=robot)
    params = PlannerParams(method=Method.PREDICTIVE)
    done = simulate_fleet(scenario, planner=preset(params), sensor=SensorParams(), seed=0)
    assert all(evaluate(episode).success for episode in done)


@given(
    st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.integers(1, 4)), max_size=12)
)
def test_path_as_obstacle_passes_through_the_poses(
    stretches: list[tuple[float, float, int]],
) -> None:
    poses = [Pose2D(1.0, -2.0)]
    for vx, vy, ticks in stretches:
        for _ in range(ticks):
            poses.append(Pose2D(poses[-1].x + 0.1 * vx, poses[-1].y + 0.1 * vy))
    obstacle = path_as_obstacle(poses, 100_000_000, 0.3)
    for k, pose in enumerate(poses):
        center = center_at(obstacle, k * 100_000_000 * 1e-9)
        assert distance(center, pose.position) < 1e-9
    # Motion as small as rounding errors may count as several stretches.
    if all(v == 0.0 or abs(v) > 1e-3 for vx, vy, _ in stretches for v in (vx, vy)):
        assert len(obstacle.turns) <= len(stretches) + 1


def test_other_robots_are_in_scenario_sequence() -> None:
    scenario = load_scenario("swap")
    fleet = Fleet(scenario, TICK_NS, 0.02)
    starts = [member.start_m for member in scenario.robots]
    without_the_third = starts[:2] + starts[3:]
    assert fleet.robot_worlds[2].centers() == without_the_third
    assert [center for center, _ in fleet.robot_worlds[2].near(1.0)[1]] == without_the_third
    third = run_fleet(scenario, seed=0, go_on=lambda fleet: fleet.tick < 3)[2]
    assert [o.center_m for o in third.scenario.obstacles] == without_the_third


def test_planner_parameters_apply_to_a_fleet() -> None:
    params = PlannerParams(speed_limit=SpeedLimitParams(slow_within_m=0.8))
    own = run_fleet(head_on(), planner=params, seed=3)
    again = simulate_fleet(head_on(), planner=params, sensor=SensorParams(), seed=3)
    assert [e.ticks for e in own] == [e.ticks for e in again]
    assert any("% speed so near" in tick.reason for e in own for tick in e.ticks)


def test_a_fleet_scenario_survives_a_round_trip() -> None:
    scenario = load_scenario("swap")
    assert len(scenario.robots) == 10
    assert (scenario.start_m, scenario.goal_m) == ((6.0, 0.0), (-6.0, 0.0))
    assert load_scenario(scenario_to_json(scenario)) == scenario
    assert "robots" not in scenario_to_json(load_scenario("case1"))
    assert single_robot_scenario(scenario, 1).start_m == scenario.robots[1].start_m


TWO = (((0.0, 0.0), (5.0, 0.0)), ((2.0, 0.0), (5.0, 5.0)))


@pytest.mark.parametrize(
    ("make_it", "what"),
    [
        (
            lambda: FleetRobot(name="a/b", start_m=(0.0, 0.0), goal_m=(1.0, 0.0)),
            "not a ROS namespace",
        ),
        (
            lambda: FleetRobot(name="a__b", start_m=(0.0, 0.0), goal_m=(1.0, 0.0)),
            "not a ROS namespace",
        ),
        (lambda: FleetRobot(name="a", start_m=(0.0, 0.0), goal_m=(0.0, 0.0)), "equal to start_m"),
        (lambda: fleet_of(*TWO, ((0.4, 0.0), (5.0, 9.0))), "start_m: 0.2 m into each other"),
        (lambda: fleet_of(*TWO, ((9.0, 0.0), (5.1, 5.0))), "goal_m: 0.5 m into each other"),
        (lambda: replace(fleet_of(*TWO), start_m=(1.0, 1.0)), "leave those two out"),
        (
            lambda: fleet_of(*TWO, walls=Walls(lower_m=(-9.0, -9.0), upper_m=(9.0, 9.0))),
            "walls not supported",
        ),
        (
            lambda: fleet_of(*TWO, kidnappings=(Kidnapping(at_s=1.0, to_m=(0.0, 0.0)),)),
            "kidnappings not supported",
        ),
        (
            lambda: fleet_of(*TWO, obstacles=(Obstacle(center_m=(2.0, 0.3), radius_m=0.3),)),
            "inside obstacle 1",
        ),
        (lambda: run(head_on()), "names 2 robots"),
        (lambda: World(head_on(), TICK_NS, 0.02), "names 2 robots"),
        (lambda: Fleet(load_scenario("case1"), TICK_NS, 0.02), "names no robots"),
        (lambda: load_scenario('{"name": "x", "robots": [{"name": "a"}]}'), "missing"),
        (lambda: load_scenario('{"name": "x", "robots": []}'), "start_m: missing"),
    ],
)
def test_invalid_fleets_are_refused(make_it: Any, what: str) -> None:
    with pytest.raises(ConfigError) as caught:
        make_it()
    assert what in str(caught.value)
    assert "\n" not in str(caught.value)


PAPER = ("--planner", "paper")  # which decides many times faster


@pytest.mark.no_cover
def test_sim_prints_a_row_per_robot_or_per_seed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["sim", "swap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 12
    assert lines[1].split()[:2] == ["robot0", "goal_reached"]
    assert lines[-1] == "10 of 10 robots at the goal without collision"
    assert cli.main(["sim", "swap", *PAPER, "--seeds", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split()[:4] == ["0", "10", "of", "10"]
    assert lines[-1] == "2 of 2 seeds with all robots at the goal without collision"


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`mfba run` of four robots: the whole graph in one call."""
    directory = tmp_path_factory.mktemp("fleet")
    whole = load_scenario("swap")
    four = replace(whole, robots=whole.robots[::5] + whole.robots[2::5])
    file = directory / "some.json"
    file.write_text(scenario_to_json(four), encoding="utf-8")
    assert (
        cli.main(["run", str(file), *PAPER, "--seed", "3", "--out", str(directory / "run")]) == 0
    )
    return directory / "run"


def test_the_graph_decides_as_the_core_does(driven: Path) -> None:
    scenario = load_scenario(str(driven.parent / "some.json"))
    core = run_fleet(scenario, seed=3)
    recorded = tuple(read_recording(driven / "bag").episodes.values())
    assert [digest(e.ticks) for e in recorded] == [digest(e.ticks) for e in core]
    assert tuple(replace(e, driver="core") for e in recorded) == core


def test_every_robot_has_its_topics_in_its_namespace(driven: Path) -> None:
    names = {member.name for member in load_scenario(str(driven.parent / "some.json")).robots}
    core = run_fleet(load_scenario(str(driven.parent / "some.json")), seed=3)
    with BagReader(driven / "bag") as reader:
        counts = {name: topic.message_count for name, topic in reader.topics.items()}
    assert counts["/clock"] == max(len(episode.ticks) for episode in core)
    for episode, name in zip(core, ["robot0", "robot5", "robot2", "robot7"], strict=True):
        assert name in names
        for topic in ("odom", "obstacles", "sectors", "goal_step", "cmd_vel", "planner/decision"):
            assert counts[f"/{name}/{topic}"] == len(episode.ticks)
    assert "/odom" not in counts


def test_a_result_for_each_robot_and_one_picture(driven: Path) -> None:
    found = sorted(path.name for path in driven.iterdir())
    assert found == ["bag", *(f"robot{n}.json" for n in (0, 2, 5, 7)), "run.png"]
    core = run_fleet(load_scenario(str(driven.parent / "some.json")), seed=3)
    result = read_result(driven / "robot0.json")
    assert result["digest"] == digest(core[0].ticks)
    assert result["result"]["success"]
    assert result["extra"]["fleet_seed"] == 3
    assert result["seed"] == robot_seed(3, 0)


def test_commands_for_one_robot_refuse_a_fleet(driven: Path) -> None:
    with pytest.raises(BagError, match="holds 4 robots, but this reads a bag of one"):
        read_episode(driven / "bag")
    for args, what in (
        (["--real-time"], "--real-time: 10 robots run in lockstep only; leave it out"),
        (["--driver", "core"], "use `mfba sim`"),
    ):
        with pytest.raises(ConfigError, match=what):
            cli.main(["run", "swap", *args])
    with pytest.raises(ConfigError, match="leave it out"):
        cli.main(["sim", "swap", "--out", "x"])
