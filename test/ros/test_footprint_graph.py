# SPDX-License-Identifier: Apache-2.0
"""A robot with a footprint in the real graph: decisions as in the core, judged by its circles."""

from pathlib import Path

import pytest

from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface.markers import world_markers
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import parse_scenario
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.world import World
from mfba_planner.verification.verify_bag import verify

CART = parse_scenario(
    """
    name: cart
    start_m: [0, 0]
    goal_m: [4, 0.5]
    robot:
      drive: differential
      footprint_m: [[0.2, 0, 0.2], [-0.2, 0.01, 0.2]]
    obstacles:
      - {center_m: [2, 0.9], radius_m: 0.2}
    """,
    "cart",
)


def test_the_graph_decides_as_the_core_and_verify_agrees(tmp_path: Path, domain_id: int) -> None:
    params = PlannerParams(goal_tolerance_m=0.05)
    config = RunConfig(scenario=CART, planner=params, seed=3, driver=Driver.IN_PROCESS)
    run_in_process(config, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    expected = simulate(CART, planner=params, sensor=SensorParams(), seed=3)
    assert recorded.scenario == CART
    assert recorded.ticks == expected.ticks
    assert evaluate(recorded) == evaluate(expected)
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


def test_viewers_get_a_disc_for_each_circle() -> None:
    marks = world_markers(World(CART, 100_000_000, 0.1), 1, "odom").markers
    robot = [mark for mark in marks if mark.ns == "robot"]
    assert [mark.id for mark in robot] == [0, 1]
    assert [(m.pose.position.x, m.pose.position.y) for m in robot] == [(0.2, 0.0), (-0.2, 0.01)]
    assert [mark.scale.x for mark in robot] == pytest.approx([0.4, 0.4])
