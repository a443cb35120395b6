# SPDX-License-Identifier: Apache-2.0
"""Wall segments in the real graph: sensed from obstacles and from a scan, as in the core."""

from dataclasses import replace
from pathlib import Path

import pytest
from visualization_msgs.msg import Marker
from walled_place import PLACE

from mfba_planner.core.errors import ConfigError
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface.markers import world_markers
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_json import parse_segments, segments_text
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.world import World
from mfba_planner.verification.verify_bag import verify

PAPER = PlannerParams(goal_tolerance_m=0.05)


@pytest.mark.parametrize("robot", [Robot(), Robot(lidar=Lidar(beams=360))], ids=["ring", "lidar"])
def test_the_graph_decides_as_the_core_and_verify_agrees(
    robot: Robot, tmp_path: Path, domain_id: int
) -> None:
    scenario = replace(PLACE, robot=robot)
    config = RunConfig(scenario=scenario, planner=PAPER, seed=3, driver=Driver.IN_PROCESS)
    run_in_process(config, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    expected = simulate(scenario, planner=PAPER, sensor=SensorParams(), seed=3)
    assert recorded.ticks == expected.ticks
    assert recorded.scenario == scenario
    assert expected.outcome is Outcome.GOAL_REACHED
    without = simulate(
        replace(scenario, segments_m=()), planner=PAPER, sensor=SensorParams(), seed=3
    )
    assert [t.vs for t in expected.ticks] != [t.vs for t in without.ticks], "no wall was sensed"
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


def test_the_sensor_gets_the_walls_only_where_it_has_no_scan() -> None:
    with_ring = node_parameters(RunConfig(scenario=PLACE), ())["virtual_sensor"]
    assert parse_segments(with_ring["segments_m"]) == PLACE.segments_m
    scanning = replace(PLACE, robot=Robot(lidar=Lidar(beams=360)))
    assert "segments_m" not in node_parameters(RunConfig(scenario=scanning), ())["virtual_sensor"]
    empty = replace(PLACE, segments_m=())
    assert "segments_m" not in node_parameters(RunConfig(scenario=empty), ())["virtual_sensor"]


def test_viewers_get_the_walls_as_lines() -> None:
    marks = world_markers(World(PLACE, 100_000_000, 0.1), 1, "odom").markers
    (walls,) = [mark for mark in marks if mark.ns == "walls"]
    ends = [(point.x, point.y) for point in walls.points]
    assert ends == [(2.0, -0.9), (2.0, 0.1), (4.0, 0.1), (5.0, 1.1)]
    assert (walls.type, walls.action) == (Marker.LINE_LIST, Marker.ADD)
    open_place = World(replace(PLACE, segments_m=()), 100_000_000, 0.1)
    (none,) = [m for m in world_markers(open_place, 1, "odom").markers if m.ns == "walls"]
    assert none.action == Marker.DELETE, "viewers report a line without points as an error"


def test_segments_as_a_parameter() -> None:
    odd = ((0.1 + 0.2, -1e-7, 1e6, 2.0 / 3.0),)
    assert parse_segments(segments_text(odd)) == odd
    assert parse_segments("[[0, 0, 1, 1]]") == ((0.0, 0.0, 1.0, 1.0),)
    assert parse_segments(" ") == ()


@pytest.mark.parametrize("text", ["x", "[1, 2, 3, 4]", "[[1, 2, 3]]", "[[1, 2, 3, NaN]]", "{}"])
def test_refused_segments_of_a_parameter(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_segments(text)
    assert str(caught.value) == (
        f"segments_m={text!r}: not a list of segments; give [[x0, y0, x1, y1], ...], m"
    )
