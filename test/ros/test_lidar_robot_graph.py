# SPDX-License-Identifier: Apache-2.0
"""Differential drive and lidar in the real graph: the core's decisions, and the messages."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edited_bags import rewrite
from planner_talk import PlannerHarness, fields, odom, sectors
from ros_graph import Graph

from mfba_planner.core.planner_types import Mode, Scan
from mfba_planner.core.robot_base import Drive
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import Method, PerceptionInput, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.from_messages import laser_scan, robot_pose
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import scan_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.verification.verify_bag import verify

PAPER = PlannerParams(goal_tolerance_m=0.05)
TRACKING = replace(preset(PAPER), method=Method.PREDICTIVE)
AHEAD = replace(TRACKING, perception=PerceptionInput.SECTORS)
TURNING = Robot(drive=Drive.DIFFERENTIAL)
SCANNING = replace(TURNING, lidar=Lidar(beams=360, yaw_rad=1.0))
MOUNTED = Lidar(beams=360, x_m=0.12, y_m=-0.05, yaw_rad=1.0, flipped=True)
NOISY = replace(
    SCANNING,
    noise=Noise(
        odom_m=0.01, odom_rad=0.01, odom_loss=0.1, odom_latency_s=0.1,
        scan_m=0.01, scan_dropout=0.1, scan_loss=0.02, scan_latency_s=0.1,
    ),
)  # fmt: skip
ROBOTS = {
    "turning": TURNING,
    "scanning": SCANNING,
    "mounted": replace(TURNING, lidar=MOUNTED),
    "noisy": NOISY,
    "noisy, mounted": replace(NOISY, lidar=MOUNTED),
    "omnidirectional": replace(NOISY, drive=Drive.OMNIDIRECTIONAL),
}


def near(robot: Robot) -> Scenario:
    """A short trip past the obstacles of case 1."""
    case = load_scenario("case1")
    return replace(case, start_m=(9.4, 4.2), goal_m=(9.6, 8.0), robot=robot)


def run_config(scenario: Scenario, planner: PlannerParams) -> RunConfig:
    return RunConfig(scenario=scenario, planner=planner, seed=3, driver=Driver.IN_PROCESS)


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@pytest.mark.parametrize("planner", [PAPER, AHEAD, TRACKING], ids=["paper", "ahead", "tracking"])
def test_the_graph_decides_as_the_core_and_verify_agrees(
    robot: Robot, planner: PlannerParams, tmp_path: Path, domain_id: int
) -> None:
    scenario = near(robot)
    if planner.reads_scan and not robot.lidar.beams:
        scenario = replace(scenario, robot=replace(robot, lidar=Lidar(beams=1080)))
    run_in_process(run_config(scenario, planner), tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    expected = simulate(scenario, planner=planner, sensor=SensorParams(), seed=3)
    assert recorded.ticks == expected.ticks
    assert digest(recorded.ticks) == digest(expected.ticks)
    assert expected.outcome is Outcome.GOAL_REACHED
    assert recorded.scenario == scenario
    assert any(tick.vs and any(tick.vs) for tick in recorded.ticks), "no obstacle was observed"
    assert {tick.perception for tick in recorded.ticks if tick.mode is not Mode.STOPPED} == {
        "scan" if planner is TRACKING else "sectors"
    }
    report = verify(tmp_path / "bag")
    assert report.is_identical, report.faults


def test_verify_knows_which_scans_the_sensor_would_refuse(tmp_path: Path, domain_id: int) -> None:
    scenario = near(SCANNING)
    run_in_process(run_config(scenario, PAPER), tmp_path / "bag", domain_id=domain_id)

    def expecting(frame: str) -> Callable[[Any], Any]:
        def configure(content: Any) -> Any:
            content["nodes"]["virtual_sensor"]["scan_frame"] = frame
            return content

        return configure

    same = rewrite(tmp_path / "bag", tmp_path / "same", list, configure=expecting("base_scan"))
    assert verify(same).is_identical
    other = rewrite(tmp_path / "bag", tmp_path / "other", list, configure=expecting("rear"))
    report = verify(other)
    assert len(report.faults) == len(report.recorded)
    assert all("/sectors does not match the sensor" in fault for fault in report.faults)


def start(graph: Graph, config: RunConfig, **more: Any) -> WorldSim:
    parameters = node_parameters(config, peers=())
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    planner = graph.start(PlannerNode, parameters["planner"])
    world = graph.start(WorldSim, {**parameters["world_sim"], **more})
    graph.until(lambda: planner.goals.goal_queue.goal is not None)
    return world


@pytest.mark.parametrize("beams", [360, 720, 1080])
def test_the_messages_of_a_lidar_robot(graph: Graph, beams: int) -> None:
    scans, odoms = graph.collect(topics.SCAN), graph.collect(topics.ODOM)
    sectors, twists = graph.collect(topics.SECTORS), graph.collect(topics.CMD_VEL)
    robot = replace(SCANNING, lidar=Lidar(beams=beams, yaw_rad=1.0))
    world = start(graph, run_config(near(robot), PAPER))
    world.resume()
    graph.until(lambda: world.world.tick >= 6)
    world.tick_control.paused = True
    graph.settle()
    ticks = world.world.tick + 1
    assert len(scans) == len(odoms) == len(sectors) == len(twists) == ticks
    assert {scan.header.frame_id for scan in scans} == {"base_scan"}
    assert {message.header.frame_id for message in sectors} == {"odom"}
    expected = simulate(
        near(robot), planner=PAPER, sensor=SensorParams(), seed=3, go_on=lambda w: w.tick < 6
    )
    for scan, odometry, tick in zip(scans, odoms, expected.ticks):
        assert (scan.header.stamp, len(scan.ranges)) == (odometry.header.stamp, beams)
        assert robot_pose(odometry) == tick.pose
        assert laser_scan(scan).range_max_m == pytest.approx(3.5)
    for twist in twists:
        assert twist.linear.y == 0.0
    assert any(twist.angular.z for twist in twists)
    assert odoms[-1].twist.twist.linear.x == pytest.approx(world.world.speeds.v)
    assert odoms[-1].twist.twist.angular.z == world.world.speeds.omega


def test_parameters_of_world_sim_replace_the_robot(graph: Graph) -> None:
    world = graph.start(
        WorldSim,
        {"scenario": "case2", "robot.drive": "differential", "robot.lidar.beams": 12},
    )
    assert world.scenario.robot == Robot(drive=Drive.DIFFERENTIAL, lidar=Lidar(beams=12))
    stated = world.get_parameter("scenario_json").value
    assert load_scenario(stated) == world.scenario


def test_it_drives_in_real_time_too(tmp_path: Path, domain_id: int) -> None:
    config = replace(run_config(near(SCANNING), TRACKING), real_time=True, speed_factor=2.0)
    run_in_process(config, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    assert recorded.outcome is Outcome.GOAL_REACHED


def test_a_decision_has_the_scan_of_its_stamp_however_late_its_odom_is(graph: Graph) -> None:
    """An obstacle ahead in the first scan, none in the second; then the odometry of both."""
    config = run_config(near(SCANNING), TRACKING)
    harness = PlannerHarness(graph, node_parameters(config, peers=())["planner"], at=(9.0, 0.0))
    scans = graph.writer(topics.SCAN)
    free = Scan(
        ranges_m=np.full(360, np.inf), angle_min_rad=-math.pi,
        angle_increment_rad=math.radians(1.0), range_min_m=0.1, range_max_m=3.5,
    )  # fmt: skip
    blocked = free.ranges_m.copy()
    blocked[180 - 57 - 20 : 180 - 57 + 20] = 0.8  # towards +x: the lidar's yaw is 1 rad
    for stamp, ranges in ((1, blocked), (2, free.ranges_m)):
        scans.publish(scan_msg(replace(free, ranges_m=ranges), stamp, "base_scan"))
        harness.sectors.publish(sectors(stamp))
        graph.settle()
    first, second = harness.decide_all(odom(1), odom(2))
    assert "1" in fields(first)["vs"]
    assert fields(second)["vs"] != fields(first)["vs"]
