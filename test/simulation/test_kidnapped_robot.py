# SPDX-License-Identifier: Apache-2.0
"""The kidnapped robot: detection, report, reset of the planner, arrival."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from ros_graph import Graph

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D, distance
from mfba_planner.core.planner_types import Mode, observe
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import assess, evaluate, tick_clearances
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.odometry_jump import is_odometry_jump
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams, Swarm
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import pose_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.run_episode import run, simulate
from mfba_planner.simulation.scenario import Kidnapping, Scenario
from mfba_planner.verification.verify_bag import verify

KIDNAPPED = load_scenario("kidnapped")
FREE = (float("inf"),) * 12
PLANNERS = {
    "paper": PlannerParams(),
    "persistent": PlannerParams(swarm=Swarm.PERSISTENT),
    "predictive": replace(preset(), method=Method.PREDICTIVE),
}


def carried(episode: Episode) -> list[int]:
    return [k for k, tick in enumerate(episode.ticks) if is_odometry_jump(tick.reason)]


def simulated(scenario: Scenario, planner: PlannerParams) -> Episode:
    return simulate(scenario, planner=planner, sensor=SensorParams(), seed=1)


@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_both_kidnappings_are_detected_and_the_goal_is_reached(planner: PlannerParams) -> None:
    episode = simulated(KIDNAPPED, planner)
    assert evaluate(episode).success
    noticed = carried(episode)
    times_s = [episode.time_s(episode.ticks[k].stamp_ns) for k in noticed]
    tick_s = planner.tick_ns * 1e-9
    assert [t - at.at_s for t, at in zip(times_s, KIDNAPPED.kidnappings)] == pytest.approx(
        [tick_s / 2] * 2, abs=tick_s / 2 + 1e-9
    )
    for k, kidnapping in zip(noticed, KIDNAPPED.kidnappings):
        assert episode.ticks[k].pose.position == kidnapping.to_m
        assert ", beginning anew; " in episode.ticks[k].reason


@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_after_a_kidnapping_it_decides_as_a_fresh_planner(planner: PlannerParams) -> None:
    """The planner resets its memory at an odometry jump: a new planner decides the same."""
    episode = simulated(KIDNAPPED, planner)
    first, second = carried(episode)
    fresh = make_planner(planner, SensorParams(), seed=1)
    for tick in episode.ticks[first:second]:
        obs = observe(tick.stamp_ns, tick.pose, tick.ranges_m, tick.goal, tick.pose)
        own = fresh.plan(obs)
        assert (own.waypoint, own.velocity, own.mode) == (tick.waypoint, tick.velocity, tick.mode)


def test_a_kidnapping_adds_no_length_and_no_contact() -> None:
    post = Obstacle(center_m=(2.0, 3.0), radius_m=0.5)  # on the straight line to the new position
    scenario = Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=(6.0, 0.0),
        obstacles=(post,),
        kidnappings=(Kidnapping(at_s=2.0, to_m=(3.0, 6.0)),),
    )
    episode = run(scenario, seed=2)
    (k,) = carried(episode)
    positions = [tick.pose.position for tick in episode.ticks]
    steps = [distance(a, b) for a, b in zip(positions, positions[1:])]
    result, run_motion = assess(episode)
    assert result.collisions == 0
    assert result.length_m == pytest.approx(sum(steps) - steps[k - 1])
    assert run_motion.jerk_mps3 < 5.0
    assert min(map(min, tick_clearances(episode))) == pytest.approx(result.min_clearance_m)


def observe_sectors(stamp_ns: int, x: float) -> Any:
    return observe(stamp_ns, Pose2D(x, 0.0), FREE, (100.0, 0.0), Pose2D(0.0, 0.0))


@given(
    stretch=st.floats(0.0, 2.0),
    took_s=st.floats(0.01, 5.0),
    jump_m=st.floats(0.05, 3.0),
)
@settings(max_examples=60)
def test_only_impossible_moves_are_an_odometry_jump(
    stretch: float, took_s: float, jump_m: float
) -> None:
    planner = Algorithm1(PlannerParams(jump_m=jump_m), seed=0)
    planner.plan(observe_sectors(1_000_000_000, 0.0))
    farthest = planner.params.speed_mps * took_s + jump_m
    decision = planner.plan(
        observe_sectors(1_000_000_000 + round(took_s * 1e9), farthest * stretch)
    )
    if abs(stretch - 1.0) > 1e-6:
        assert is_odometry_jump(decision.reason) is (stretch > 1.0)


def test_a_refused_pose_is_no_odometry_jump() -> None:
    planner = Algorithm1(PlannerParams(), seed=0)
    planner.plan(observe_sectors(1, 0.0))
    refused = observe(2, "odom holds nan", FREE, (100.0, 0.0), Pose2D(50.0, 0.0))
    assert planner.plan(refused).mode is Mode.STOPPED
    assert not is_odometry_jump(planner.plan(observe_sectors(3, 0.1)).reason)
    assert is_odometry_jump(planner.plan(observe_sectors(4, 9.0)).reason)
    assert not is_odometry_jump(planner.plan(observe_sectors(3, 0.0)).reason)  # time was set back


def test_the_graph_is_kidnapped_as_the_core_is(tmp_path: Path, domain_id: int) -> None:
    config = RunConfig(scenario=KIDNAPPED, seed=1, driver=Driver.IN_PROCESS)
    run_in_process(config, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    assert recorded.ticks == simulated(KIDNAPPED, PlannerParams()).ticks
    assert len(carried(recorded)) == 2
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


def start(graph: Graph, scenario: Scenario) -> WorldSim:
    parameters = node_parameters(RunConfig(scenario=scenario, seed=6), peers=())
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    planner = graph.start(PlannerNode, parameters["planner"])
    world = graph.start(WorldSim, parameters["world_sim"])
    graph.until(lambda: planner.goals.goal_queue.goal is not None)
    return world


@pytest.mark.parametrize("drive", list(Drive))
def test_initialpose_moves_the_robot_and_the_planner_reports_it(
    graph: Graph, drive: Drive
) -> None:
    decisions = graph.collect(topics.DECISION)
    case = load_scenario("case1")
    world = start(graph, replace(case, robot=replace(case.robot, drive=drive)))
    world.resume()
    graph.until(lambda: world.world.tick > 20)
    pose = PoseWithCovariance(pose=pose_msg(2.0, 11.0, 0.5))
    graph.writer(topics.INITIALPOSE).publish(PoseWithCovarianceStamped(pose=pose))
    graph.until(lambda: world.over, timeout_s=60.0)
    graph.settle()
    assert world.world.outcome() is Outcome.GOAL_REACHED
    reports = [m.status[0] for m in decisions if is_odometry_jump(m.status[0].message)]
    assert len(reports) == 1
    assert reports[0].level == b"\x01"


@pytest.mark.parametrize(
    ("kidnappings", "reason"),
    [
        ("[{at_s: 1.0, to_m: [4, 4]}]", r"kidnapping to_m=\[4.0, 4.0\]: 0.6 m inside obstacle 1"),
        ("[{at_s: 0.0, to_m: [1, 1]}]", r"kidnappings.1.at_s=0.0: refused; give a number "),
        ("[{at_s: 2.0, to_m: [1, 1]}, {at_s: 2.0, to_m: [1, 1]}]",
         r"kidnappings: at_s=2 does not come after 2; sort the kidnappings by time"),
        ("[{at_s: 2.0, to: [1, 1]}]", r"kidnappings.1.to: unknown key; did you mean 'to_m'\?"),
        ("[{at_s: 2.0}]", r"kidnappings.1.to_m: missing"),
    ],
)  # fmt: skip
def test_invalid_kidnappings_are_refused(kidnappings: str, reason: str) -> None:
    text = (
        "{name: x, start_m: [0, 0], goal_m: [9, 9], "
        f"obstacles: [{{center_m: [4, 4], radius_m: 0.3}}], kidnappings: {kidnappings}}}"
    )
    with pytest.raises(ConfigError, match=f"^it: {reason}"):
        parse_scenario(text, "it")


def test_kidnappings_survive_a_round_trip() -> None:
    assert parse_scenario(scenario_to_json(KIDNAPPED), "again") == KIDNAPPED


def free_point(rng: np.random.Generator, scenario: Scenario, t_s: float) -> Point:
    while True:
        x, y = rng.uniform(0.5, 11.5, size=2).tolist()
        if all(distance((x, y), c) > r + 0.3 for c, r in scenario.enlarged(t_s)):
            return (x, y)


def test_the_goal_is_reached_from_any_kidnapping() -> None:
    rng = np.random.default_rng(5)
    case = load_scenario("case1")
    for seed in range(10):
        at_s = float(rng.uniform(0.5, 20.0))
        kidnapping = Kidnapping(at_s=at_s, to_m=free_point(rng, case, at_s))
        episode = run(replace(case, kidnappings=(kidnapping,)), seed=seed)
        assert episode.outcome is Outcome.GOAL_REACHED
        assert len(carried(episode)) == 1
