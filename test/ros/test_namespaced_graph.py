# SPDX-License-Identifier: Apache-2.0
"""A whole graph in a namespace, as of a launch file's `namespace`: recorded, read, verified."""

from pathlib import Path

import pytest
from ros_graph import Graph

from mfba_planner.core.option_specs import flatten
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.read_episode import read_recording
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import NODES, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.verification.verify_bag import verify_each


@pytest.mark.parametrize("namespace", ["robot1", "fleet/robot1"])
def test_a_simulation_in_a_namespace_verifies(
    graph: Graph, namespace: str, tmp_path: Path
) -> None:
    planner = PlannerParams(goal_tolerance_m=0.05)
    config = RunConfig(scenario=load_scenario("case1"), planner=planner, seed=1)
    parameters = node_parameters(config, peers=())
    recorder = graph.start(
        Recorder,
        {"output": str(tmp_path / "bag"), "nodes": ",".join(NODES), "sim_time": True},
        namespace=namespace,
    )
    graph.start(VirtualSensor, parameters["virtual_sensor"], namespace=namespace)
    node = graph.start(PlannerNode, parameters["planner"], namespace=namespace)
    world = graph.start(WorldSim, parameters["world_sim"], namespace=namespace)
    graph.until(lambda: not recorder.missing())
    graph.until(lambda: node.goals.goal_queue.goal is not None)
    world.resume()
    graph.until(lambda: world.over)
    graph.settle()
    graph.stop(recorder)
    report = verify_each(tmp_path / "bag")[namespace]
    assert report.is_identical, report.faults
    expected = simulate(config.scenario, planner=planner, sensor=config.sensor, seed=1)
    assert report.recorded == expected.ticks
    (episode,) = read_recording(tmp_path / "bag").episodes.values()
    assert flatten(episode.planner) == flatten(expected.planner)
