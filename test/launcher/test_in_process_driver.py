# SPDX-License-Identifier: Apache-2.0
"""The in-process driver makes the same decisions as the core, tick by tick."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
from ros_graph import Graph

from mfba_planner.core.errors import GraphError
from mfba_planner.core.option_specs import override
from mfba_planner.core.planner_types import NANO, Mode
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.paper import readings_of_paper
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import pose_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation import episode, run_episode
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.world import World
from mfba_planner.verification.verify_bag import verify


def config(
    scenario: str, planner: PlannerParams, seed: int, sensor: SensorParams | None = None
) -> RunConfig:
    return RunConfig(
        scenario=load_scenario(scenario),
        planner=planner,
        sensor=sensor or SensorParams(),
        seed=seed,
        driver=Driver.IN_PROCESS,
    )


def run_and_compare(run_config: RunConfig, bag: Path, domain_id: int) -> episode.Episode:
    """Run the graph, read its bag back and compare it with the core's run."""
    run_in_process(run_config, bag, domain_id=domain_id)
    recorded = read_episode(bag)
    expected = simulate(
        run_config.scenario,
        planner=run_config.planner,
        sensor=run_config.sensor,
        seed=run_config.seed,
    )
    assert recorded.ticks == expected.ticks
    assert recorded.outcome is expected.outcome
    assert (recorded.scenario, recorded.sensor, recorded.planner, recorded.seed) == (
        expected.scenario,
        expected.sensor,
        expected.planner,
        expected.seed,
    )
    assert recorded.driver == "in-process"
    return recorded


@pytest.mark.parametrize("algorithm", ["mfba", "ba"])
@pytest.mark.parametrize("scenario", ["case1", "case2"])
def test_both_case_studies_with_both_algorithms(
    scenario: str, algorithm: str, tmp_path: Path, domain_id: int
) -> None:
    planner = override(PlannerParams(), {"bat.algorithm": algorithm})
    paths = set()
    for seed in range(5):
        bag = tmp_path / f"seed{seed}"
        recorded = run_and_compare(config(scenario, planner, seed), bag, domain_id)
        result = evaluate(recorded)
        assert result.success, f"seed {seed}: {result}"
        paths.add(recorded.ticks)
    assert len(paths) == 5, "the seed does nothing"


@pytest.mark.parametrize("scenario", ["walled", "empty"])
def test_other_worlds(scenario: str, tmp_path: Path, domain_id: int) -> None:
    recorded = run_and_compare(config(scenario, PlannerParams(), 1), tmp_path / "bag", domain_id)
    assert recorded.outcome is Outcome.GOAL_REACHED


def test_the_persistent_swarm_of_fig_1(tmp_path: Path, domain_id: int) -> None:
    run_config = config("case2", readings_of_paper.planner("fig1"), 2)
    recorded = run_and_compare(run_config, tmp_path / "bag", domain_id)
    assert recorded.outcome is Outcome.GOAL_REACHED


@pytest.mark.parametrize("scenario", ["case1", "case2"])
def test_the_predictive_planner(scenario: str, tmp_path: Path, domain_id: int) -> None:
    """On the same sectors its path is not longer than the paper's; its bag can be verified."""
    paper = config(scenario, PlannerParams(), 1)
    run_config = replace(paper, planner=preset(PlannerParams(method=Method.PREDICTIVE)))
    recorded = run_and_compare(run_config, tmp_path / "bag", domain_id)
    result = evaluate(recorded)
    assert result.success
    others = run_episode.run(paper.scenario, planner=paper.planner, seed=1)
    assert result.length_m <= evaluate(others).length_m + paper.planner.goal_tolerance_m
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


@pytest.mark.parametrize(
    "optimizer",
    [
        "random",
        "grid",
        "none",
        "scipy:differential_evolution",
        "cmaes:CMA",
        "niapy:ParticleSwarmAlgorithm",
        "mealpy:PSO.OriginalPSO",
    ],
)
def test_other_optimizers(optimizer: str, tmp_path: Path, domain_id: int) -> None:
    library, colon, _ = optimizer.partition(":")
    if colon:
        pytest.importorskip(library)
    planner = PlannerParams(optimizer=optimizer)
    recorded = run_and_compare(config("case1", planner, 1), tmp_path / "bag", domain_id)
    assert evaluate(recorded).success
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


def test_another_number_of_sectors(tmp_path: Path, domain_id: int) -> None:
    sensor = SensorParams(sectors=36, sensing_range_m=1.5)
    run_config = config("case2", PlannerParams(), 4, sensor)
    recorded = run_and_compare(run_config, tmp_path / "bag", domain_id)
    assert len(recorded.ticks[0].vs) == 36


def test_a_run_can_be_ended_early(tmp_path: Path, domain_id: int) -> None:
    def first_ten(world: World) -> bool:
        return world.tick < 10

    run_config = config("case1", PlannerParams(), 0)
    run_in_process(run_config, tmp_path / "bag", domain_id=domain_id, on_turn=first_ten)
    recorded = read_episode(tmp_path / "bag")
    assert recorded.outcome is Outcome.INTERRUPTED
    count = len(recorded.ticks)
    assert 10 <= count < 30
    assert recorded.ticks == run_episode.run(run_config.scenario).ticks[:count]


def test_a_run_that_takes_too_long_is_a_clear_error(tmp_path: Path, domain_id: int) -> None:
    run_config = config("case1", PlannerParams(), 0)
    with pytest.raises(GraphError, match=r"^the graph is stuck: tick \d+ after 0 s"):
        run_in_process(run_config, tmp_path / "bag", domain_id=domain_id, timeout_s=0.0)
    assert (tmp_path / "bag" / "metadata.yaml").exists(), "the bag is closed after an error too"


def test_a_real_time_run_reaches_the_goal(tmp_path: Path, domain_id: int) -> None:
    near = '{"name": "near", "start_m": [0, 0], "goal_m": [3, 0]}'
    run_config = replace(config(near, PlannerParams(), 1), real_time=True, speed_factor=4.0)
    wall_s = run_in_process(run_config, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    assert recorded.outcome is Outcome.GOAL_REACHED
    assert wall_s >= 0.9 * (len(recorded.ticks) - 1) * run_config.planner.tick_ns * NANO / 4.0


def start_loop(graph: Graph, scenario: str, seed: int, **more: Any) -> WorldSim:
    """Start world, sensor and planner, paused before the first tick; more: parameters."""
    parameters = node_parameters(config(scenario, PlannerParams(), seed), peers=())
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    planner = graph.start(PlannerNode, {**parameters["planner"], **more})
    world = graph.start(WorldSim, {**parameters["world_sim"], **more})
    graph.until(lambda: planner.goals.goal_queue.goal is not None)
    return world


def run_to_the_end(graph: Graph, world: WorldSim) -> None:
    graph.until(lambda: world.over, timeout_s=60.0)
    graph.settle()


def modes_of(messages: list[Any]) -> list[Mode]:
    fields = [{v.key: v.value for v in message.status[0].values} for message in messages]
    return [Mode(f["mode"]) for f in fields]


def test_a_loop_of_stamped_twists(graph: Graph) -> None:
    decisions = graph.collect(topics.DECISION)
    world = start_loop(graph, "case2", 6, enable_stamped_cmd_vel=True)
    world.resume()
    run_to_the_end(graph, world)
    expected = run_episode.run(load_scenario("case2"), seed=6).ticks
    assert modes_of(decisions) == [tick.mode for tick in expected]
    assert world.world.pose == expected[-1].pose


@pytest.mark.parametrize("yaw", [1.0, -2.5, math.pi])
def test_a_robot_with_another_yaw_takes_the_same_path(graph: Graph, yaw: float) -> None:
    decisions = graph.collect(topics.DECISION)
    world = start_loop(graph, "case2", 6)
    teleport(graph, 0.0, 0.0, yaw)
    world.resume()
    run_to_the_end(graph, world)
    expected = run_episode.run(load_scenario("case2"), seed=6).ticks
    assert modes_of(decisions) == [tick.mode for tick in expected]
    assert world.world.pose == pytest.approx((*expected[-1].pose.position, yaw), abs=1e-6)


def test_a_kidnapped_robot_reaches_the_goal(graph: Graph) -> None:
    world = start_loop(graph, "case1", 6)
    world.resume()
    graph.until(lambda: world.world.tick > 20)
    teleport(graph, 2.0, 11.0, 0.5)
    run_to_the_end(graph, world)
    assert world.world.outcome() is Outcome.GOAL_REACHED


def teleport(graph: Graph, x: float, y: float, yaw: float) -> None:
    pose = PoseWithCovariance(pose=pose_msg(x, y, yaw))
    graph.writer(topics.INITIALPOSE).publish(PoseWithCovarianceStamped(pose=pose))
    graph.settle()


def test_a_restarted_planner_continues_the_run(graph: Graph) -> None:
    parameters = node_parameters(config("case2", PlannerParams(), 7), peers=())
    decisions = graph.collect(topics.DECISION)
    world = graph.start(
        WorldSim, {**parameters["world_sim"], "answer_timeout_s": 0.2, "answer_retries": 1000}
    )
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    first = graph.start(PlannerNode, parameters["planner"])
    graph.until(lambda: first.goals.goal_queue.goal is not None)
    world.resume()
    graph.until(lambda: world.world.tick > 20)
    graph.stop(first)
    graph.settle()
    left_at = world.world.tick
    second = graph.start(PlannerNode, parameters["planner"])
    run_to_the_end(graph, world)
    assert second._refused_inputs.count == 0
    expected = run_episode.run(load_scenario("case2"), seed=7).ticks
    assert left_at < len(expected) - 5, "it was restarted too late to show anything"
    assert [stamp_ns(message.header.stamp) for message in decisions] == [
        tick.stamp_ns for tick in expected
    ]
    assert modes_of(decisions) == [tick.mode for tick in expected]
    assert world.world.pose == expected[-1].pose
