# SPDX-License-Identifier: Apache-2.0
"""Odometry and lidar of the simulated robot: exact values, noise, loss, latency."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.core.planner_types import Mode
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.perception.scan_to_sectors import sense_scan
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.obstacle_motion import Walls
from mfba_planner.simulation.planner_observations import observe_sectors, sense
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.sensor_noise import NoisySensors
from mfba_planner.simulation.simulated_lidar import cast_walls, rays, scan_at
from mfba_planner.simulation.world import World

TICK_NS = 100_000_000
ROOM = Walls(lower_m=(-2.0, -1.0), upper_m=(3.0, 4.0))
angles = st.floats(-math.pi, math.pi)
SENSOR = SensorParams(sensing_range_m=2.0)


def range_at(scan: Any, k: int) -> float:
    return float(scan.ranges_m[k])


@pytest.mark.parametrize(("away_m", "reached"), [(0.49, True), (0.51, False)])
def test_noisy_odometry_may_miss_the_goal_by_four_sigma(away_m: float, reached: bool) -> None:
    scenario = Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=(away_m, 0.0),
        robot=Robot(noise=Noise(odom_m=0.1)),
    )
    assert World(scenario, TICK_NS, 0.1).outcome() is (Outcome.GOAL_REACHED if reached else None)


def test_ranges_are_those_of_real_surfaces() -> None:
    lidar = Lidar(beams=360, range_min_m=0.2, range_max_m=3.0)
    circles = [(2.0, 0.0, 0.5), (0.0, -5.0, 0.5), (-0.4, 0.0, 0.3)]
    scan = scan_at(Pose2D(0.0, 0.0), lidar, circles, None)
    assert range_at(scan, 0) == pytest.approx(1.5, abs=1e-3)  # half a degree off the middle
    assert range_at(scan, 270) == math.inf
    assert range_at(scan, 180) == -math.inf  # nearer than range_min
    assert range_at(scan, 90) == math.inf
    assert (scan.range_min_m, scan.range_max_m) == pytest.approx((0.2, 3.0))


@given(
    beams=st.sampled_from([12, 360, 720, 1080]),
    yaw=angles,
    mount=angles,
    x=st.floats(-3.0, 3.0),
    y=st.floats(-3.0, 3.0),
)
def test_sectors_stay_aligned_with_odom_however_robot_and_lidar_turn(
    beams: int, yaw: float, mount: float, x: float, y: float
) -> None:
    if distance((0.0, 0.0), (x, y)) < 1.2:
        return
    lidar = Lidar(beams=beams, yaw_rad=mount, range_max_m=9.0)
    scan = scan_at(Pose2D(0.0, 0.0, yaw), lidar, [(x, y, 0.5)], None)
    ranges = sense_scan(scan, yaw + mount, 0.3, SENSOR)
    full = sense_circles((0.0, 0.0), [((x, y), 0.8)], SENSOR)
    measured, exact = sensory_vector(ranges), sensory_vector(full)
    assert all(m <= e for m, e in zip(measured, exact)), "no sector is set without an obstacle"
    if beams >= 360 and distance((0.0, 0.0), (x, y)) < 2.5:
        assert any(measured)
        nearest = min(full)
        assert min(ranges) == pytest.approx(nearest, abs=0.02)


def test_walls_are_detected_only_if_enabled() -> None:
    pose = Pose2D(0.0, 0.0)
    assert np.isinf(scan_at(pose, Lidar(beams=12), [], ROOM).ranges_m).all()
    scan = scan_at(pose, Lidar(beams=360, walls=True, range_max_m=9.0), [], ROOM)
    assert [range_at(scan, k) for k in (0, 90, 180, 270)] == pytest.approx(
        [3.0, 4.0, 2.0, 1.0], abs=2e-3
    )


@given(x=st.floats(-9.0, 9.0), y=st.floats(-9.0, 9.0))
def test_beams_end_at_the_walls(x: float, y: float) -> None:
    ranges = cast_walls((x, y), ROOM, 36)
    c, s = rays(36)
    inside = -2.0 < x < 3.0 and -1.0 < y < 4.0
    for k in np.flatnonzero(np.isfinite(ranges)).tolist():
        ex, ey = x + ranges[k] * c[k], y + ranges[k] * s[k]
        off = min(abs(ex + 2.0), abs(ex - 3.0), abs(ey + 1.0), abs(ey - 4.0))
        assert off < 1e-9
        assert -2.0 - 1e-9 <= ex <= 3.0 + 1e-9
        assert -1.0 - 1e-9 <= ey <= 4.0 + 1e-9
    if inside:
        assert np.isfinite(ranges).all()


def sensors(seed: int = 0, **noise: float) -> NoisySensors:
    robot = Robot(lidar=Lidar(beams=360), noise=Noise(**noise))
    task = Scenario(name="x", start_m=(0.0, 0.0), goal_m=(9.0, 9.0), robot=robot)
    return NoisySensors(task, TICK_NS, seed)


POSES = [Pose2D(0.1 * k, 0.0, 0.1 * k) for k in range(200)]
POST = [(9.0, 2.0, 0.5)]


def readings(seed: int = 0, **noise: float) -> list[Any]:
    noisy = sensors(seed, **noise)
    return [noisy.read((k + 1) * TICK_NS, pose, POST) for k, pose in enumerate(POSES)]


def test_without_noise_readings_are_exact() -> None:
    assert [reading.pose for reading in readings()] == POSES
    clean = scan_at(POSES[90], Lidar(beams=360), POST, None)
    assert (readings()[90].scan.ranges_m == clean.ranges_m).all()


def test_equal_seeds_give_equal_noise() -> None:
    first, again, other = (readings(seed, odom_m=0.1, scan_m=0.1) for seed in (1, 1, 2))
    assert [r.pose for r in first] == [r.pose for r in again] != [r.pose for r in other]
    assert (first[90].scan.ranges_m == again[90].scan.ranges_m).all()
    assert (first[90].scan.ranges_m != other[90].scan.ranges_m).any()


def test_noise_of_one_sensor_does_not_change_the_other() -> None:
    both = readings(odom_m=0.1, scan_m=0.1, scan_dropout=0.1)
    assert [r.pose for r in both] == [r.pose for r in readings(odom_m=0.1)]


def test_noise_has_the_given_deviation() -> None:
    noisy = readings(odom_m=0.1, odom_rad=0.02)
    off = np.array([[r.pose.x - p.x, r.pose.y - p.y] for r, p in zip(noisy, POSES)])
    turned = np.array([r.pose.yaw - p.yaw for r, p in zip(noisy, POSES)])
    assert off.std() == pytest.approx(0.1, rel=0.15)
    assert turned.std() == pytest.approx(0.02, rel=0.2)
    errors = []
    for reading, clean in zip(readings(scan_m=0.05), readings()):
        finite = np.isfinite(clean.scan.ranges_m) & np.isfinite(reading.scan.ranges_m)
        errors += (reading.scan.ranges_m[finite] - clean.scan.ranges_m[finite]).tolist()
    assert np.std(errors) == pytest.approx(0.05, rel=0.15)


def test_shares_of_lost_readings() -> None:
    poses = [reading.pose for reading in readings(odom_loss=0.3)]
    repeated = sum(a == b for a, b in zip(poses, poses[1:]))
    assert 40 <= repeated <= 80
    assert all(pose in POSES for pose in poses)
    lost = np.mean([np.isnan(r.scan.ranges_m).mean() for r in readings(scan_dropout=0.2)])
    assert lost == pytest.approx(0.2, abs=0.01)
    blind = sum(bool(np.isnan(r.scan.ranges_m).all()) for r in readings(scan_loss=0.1))
    assert 8 <= blind <= 35


def test_latency_is_an_earlier_reading_under_a_later_stamp() -> None:
    late = readings(odom_latency_s=0.3)
    assert [reading.pose for reading in late] == [POSES[0]] * 3 + POSES[:-3]
    clean, scans = readings(), readings(scan_latency_s=0.2)
    for k in (0, 1, 2, 50, 120):
        expected = clean[max(k - 2, 0)].scan.ranges_m
        assert (scans[k].scan.ranges_m == expected).all()


def test_a_tick_has_one_reading() -> None:
    scenario = replace(load_scenario("case2"), robot=Robot(noise=Noise(odom_latency_s=0.1)))
    world = World(scenario, TICK_NS, 0.02)
    for _ in range(2):
        assert world.read().pose.x == pytest.approx(0.0)
        world.step((1.0, 0.0))
    assert world.read() is world.read()
    assert world.read().pose.x == pytest.approx(0.1)


def test_a_robot_without_a_scan_stops() -> None:
    robot = Robot(lidar=Lidar(beams=12), noise=Noise(scan_loss=0.5))
    world = World(replace(load_scenario("case1"), robot=robot), TICK_NS, 0.02, seed=3)
    planner = Algorithm1(PlannerParams(), seed=0)
    modes = set()
    for _ in range(20):
        obs = observe_sectors(world, SensorParams())
        decision = planner.plan(obs)
        assert (decision.mode is Mode.STOPPED) == bool(obs.refused)
        assert (decision.velocity == (0.0, 0.0)) == bool(obs.refused)
        modes.add(decision.mode)
        world.step(decision.velocity)
    assert modes == {Mode.STOPPED, Mode.PATH_GENERATION}


def test_circles_are_sensed_from_the_odometry_pose() -> None:
    robot = Robot(noise=Noise(odom_m=0.3))
    world = World(replace(load_scenario("case1"), robot=robot), TICK_NS, 0.02, seed=1)
    wide = SensorParams(sensing_range_m=20.0)
    assert world.read().pose != world.pose
    assert sense(world, wide) == sense_circles(
        world.read().pose.position, world.scenario.enlarged(0.0), wide
    )


NOISY = Robot(
    drive=Drive.DIFFERENTIAL, lidar=Lidar(beams=360), noise=Noise(odom_m=0.02, odom_rad=0.02)
)


def test_a_run_is_evaluated_at_true_poses(tmp_path: Path, domain_id: int) -> None:
    scenario = Scenario(name="x", start_m=(0.0, 0.0), goal_m=(2.0, 1.0), robot=NOISY)
    planner = PlannerParams(goal_tolerance_m=0.05, step_length_m=0.08)
    episode = simulate(scenario, planner=planner, sensor=SENSOR, seed=4)
    assert len(episode.truth) == len(episode.ticks)
    off = [distance(t.pose.position, p.position) for t, p in zip(episode.ticks, episode.truth)]
    assert 0.01 < np.mean(off) < 0.05
    blurred = evaluate(replace(episode, truth=()))
    result = evaluate(episode)
    assert result.success
    assert result.length_m < 2.4 < blurred.length_m  # noise adds no length
    config = RunConfig(
        scenario=scenario, planner=planner, sensor=SENSOR, seed=4, driver=Driver.IN_PROCESS
    )
    run_in_process(config, tmp_path / "bag", domain_id=domain_id)
    recorded = read_episode(tmp_path / "bag")
    assert recorded.ticks == episode.ticks
    assert recorded.outcome is episode.outcome
    assert [p.position for p in recorded.truth] == [p.position for p in episode.truth]
    assert evaluate(recorded) == result


def test_without_noise_no_true_poses_are_stored() -> None:
    scenario = Scenario(name="x", start_m=(0.0, 0.0), goal_m=(2.0, 1.0))
    assert simulate(scenario, planner=PlannerParams(), sensor=SENSOR, seed=4).truth == ()
