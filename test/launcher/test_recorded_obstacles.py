# SPDX-License-Identifier: Apache-2.0
"""Obstacles that follow recordings, appear and vanish: the same in every driver and view."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from visualization_msgs.msg import Marker

from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.report.animation import animation_bytes
from mfba_planner.report.animation_options import AnimationOptions
from mfba_planner.report.html.page_data import page_data
from mfba_planner.report.run_events import closest_passes, track
from mfba_planner.report.run_figure import png_bytes
from mfba_planner.report.tick_figure import tick_png
from mfba_planner.ros.interface.markers import world_markers
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters, with_perception
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.world import World
from mfba_planner.verification.verify_bag import verify

TEXT = """
name: recorded
start_m: [0, 0]
goal_m: [6, 0]
time_limit_s: 30
obstacles:
  - {radius_m: 0.3, trajectory: [[1, 2.5, -2], [4, 2.5, 2.5], [5, 1, 2.5]]}
  - {radius_m: 0.3, trajectory: [[0, 4.5, 2], [2.5, 4.5, -2]], loop: true}
  - {radius_m: 0.3, trajectory: [[0, 5, 1.6], [1, 4, 1.6]], stays: true}
  - {radius_m: 0.3, center_m: [3, 0.4], vanishes_s: 2.0}
  - {radius_m: 0.3, center_m: [0, 0.2], appears_s: 25}
"""
SCENARIO = parse_scenario(TEXT, "recorded.yaml")


def config(method: Method) -> RunConfig:
    params = PlannerParams()
    if method is Method.PREDICTIVE:
        params = preset(replace(params, method=method))
    scenario, params = with_perception(SCENARIO, params)
    return RunConfig(scenario=scenario, planner=params, driver=Driver.IN_PROCESS)


@pytest.fixture(scope="module")
def episode() -> Episode:
    one = config(Method.PAPER)
    return simulate(one.scenario, planner=one.planner, sensor=one.sensor, seed=0)


@pytest.mark.parametrize("method", list(Method))
def test_the_graph_decides_as_the_core_and_its_bag_is_verified(
    method: Method, tmp_path: Path, domain_id: int
) -> None:
    one = config(method)
    run_in_process(one, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    expected = simulate(one.scenario, planner=one.planner, sensor=one.sensor, seed=0)
    assert recorded.ticks == expected.ticks
    assert recorded.scenario == one.scenario
    assert verify(tmp_path / "bag").is_identical
    assert evaluate(recorded) == evaluate(expected)


def test_a_scenario_comes_back_from_its_text() -> None:
    text = scenario_to_json(SCENARIO)
    assert load_scenario(text) == SCENARIO
    plain = json.loads(text)["obstacles"]
    assert "vanishes_s" not in plain[0]
    assert plain[3]["vanishes_s"] == 2.0


def test_without_a_lidar_ros_needs_one_radius_for_all() -> None:
    several = replace(
        SCENARIO,
        obstacles=(*SCENARIO.obstacles[:-1], replace(SCENARIO.obstacles[-1], radius_m=0.2)),
    )
    one = replace(config(Method.PAPER), scenario=several)
    with pytest.raises(ConfigError, match="need a robot with a lidar in ROS 2"):
        node_parameters(one, ())
    assert node_parameters(config(Method.PAPER), ())["virtual_sensor"]["obstacle_radii_m"] == [0.3]


def test_markers_of_what_is_absent_are_taken_away() -> None:
    world = World(SCENARIO, 10**8, 0.02)
    found = {(mark.ns, mark.id): mark.action for mark in world_markers(world, 1, "odom").markers}
    assert found["obstacles", 0] == found["obstacles", 4] == Marker.DELETE
    assert found["velocities", 0] == Marker.DELETE
    assert found["obstacles", 1] == found["obstacles", 3] == Marker.ADD


def test_pictures_leave_out_what_is_absent(episode: Episode) -> None:
    passes = closest_passes(episode)
    assert [p.number for p in passes] == [1, 2, 3, 4]  # the last one comes after the end
    assert all(math.isfinite(p.gap_m) for p in passes)
    assert passes[3].time_s <= 2.0
    assert min(p.gap_m for p in passes) == pytest.approx(
        evaluate(episode).min_clearance_m, abs=3e-3
    )
    assert png_bytes(episode)
    assert tick_png(episode, len(episode.ticks) - 1, "", [])
    assert animation_bytes([("", episode)], (), ".webp", AnimationOptions())


def test_a_track_breaks_where_the_obstacle_jumps() -> None:
    loop = track(SCENARIO.obstacles[1], None, 2.0, 3.0)
    assert loop[1] == (4.5, -2.0)
    assert math.isnan(loop[2][0])
    assert loop[3] == (4.5, 2.0)
    assert track(SCENARIO.obstacles[0], None, 0.0, 0.5) == []


def test_the_page_has_no_position_for_what_is_absent(episode: Episode) -> None:
    (run,) = page_data([("", episode)], "0")["runs"]
    first, *_, fourth, last = run["world"]["obstacles"]
    times = run["ticks"]["time"]
    assert [x is None for x in first["x"]] == [not 1.0 <= t <= 5.0 for t in times]
    assert [x is None for x in fourth["x"]] == [t > 2.0 for t in times]
    assert set(last["x"]) == {None}
