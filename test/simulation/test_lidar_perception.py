# SPDX-License-Identifier: Apache-2.0
"""Perception by a lidar alone: that of `mfba sim`, with scans of their true age."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.lidar_perception import LIDAR_ROBOTS, LidarPerception, with_lidar
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.world import World

SENSOR = SensorParams()
TICK_NS = 100_000_000
CASE = load_scenario("case1")


def world_of(name: str, tick_ns: int = TICK_NS, noise_m: float = 0.0) -> World:
    return World(with_lidar(CASE, name, noise_m), tick_ns, 0.02)


def observations(name: str, ticks: int, latency_ticks: int = 0) -> list[Observation]:
    """Of a robot that drives along the diagonal."""
    world, observe = world_of(name), LidarPerception(name, latency_ticks)
    found = [observe(world, SENSOR)]
    for _ in range(ticks - 1):
        world.step((0.5, 0.5) if name == "lidar" else (0.5, 0.2))
        found.append(observe(world, SENSOR))
    return found


def test_a_lidar_sees_as_far_as_it_sees() -> None:
    """SR limits the sectors, not the scan."""
    scans = [obs.scan for obs in observations("lidar", 60)]
    finite = np.concatenate([s.ranges_m[np.isfinite(s.ranges_m)] for s in scans if s])
    assert SENSOR.sensing_range_m + CASE.robot_radius_m < 3.0 < finite.max() <= 3.5
    assert all(s is not None and s.ranges_m.size == 360 for s in scans)


def test_it_is_what_sim_gives_a_robot_with_that_lidar() -> None:
    world = world_of("lidar")
    robot = replace(CASE.robot, lidar=replace(CASE.robot.lidar, beams=360))
    sim = World(replace(CASE, robot=robot), TICK_NS, 0.02)
    observe = LidarPerception("lidar")
    for _ in range(5):
        ours, theirs = observe(world, SENSOR), observe_scan(sim, SENSOR)
        assert ours.scan is not None
        assert theirs.scan is not None
        assert ours.scan.ranges_m.tobytes() == theirs.scan.ranges_m.tobytes()
        assert replace(ours, scan=None) == replace(theirs, scan=None)
        for each in (world, sim):
            each.step((0.5, 0.5))


def test_the_realistic_robot_turns_and_errs() -> None:
    robot = LIDAR_ROBOTS["lidar-realistic"].robot
    assert robot.drive is Drive.DIFFERENTIAL
    assert (robot.noise.scan_m, robot.noise.odom_m, robot.noise.odom_rad) == (0.02, 0.02, 0.02)
    world = world_of("lidar-realistic")
    off = [obs.pose.x - CASE.start_m[0] for obs in [LidarPerception("lidar-realistic")(
        world, SENSOR)]]  # fmt: skip
    assert off[0] != 0.0
    assert not LIDAR_ROBOTS["lidar-differential"].robot.noise.affects_odometry


def test_a_late_scan_has_its_own_stamp_and_pose_beside_the_present_one() -> None:
    found = observations("lidar-realistic", 12)
    assert found[0].sensed is None
    for before, now in pairwise(found):
        assert now.sensed is not None
        stamp_ns, pose = now.sensed
        assert (stamp_ns, pose) == (before.stamp_ns, before.pose)
        assert now.pose != pose
        assert now.stamp_ns - stamp_ns == TICK_NS
    prompt, late = observations("lidar", 8), observations("lidar", 8, latency_ticks=2)
    for k in range(2, 8):
        scan, earlier = late[k].scan, prompt[k - 2].scan
        assert scan is not None
        assert earlier is not None
        assert scan.ranges_m.tobytes() == earlier.ranges_m.tobytes()
        assert late[k].sensed == (prompt[k - 2].stamp_ns, prompt[k - 2].pose)
        assert late[k].pose == prompt[k].pose
        assert late[k].ranges_m == prompt[k - 2].ranges_m


def test_the_age_is_rounded_to_whole_ticks() -> None:
    for tick_ns, ticks in ((TICK_NS, 1), (40_000_000, 2), (375_000_000, 0)):
        world, observe = world_of("lidar-realistic", tick_ns), LidarPerception("lidar-realistic")
        stamps = []
        for _ in range(5):
            obs = observe(world, SENSOR)
            stamps.append((obs.sensed or (obs.stamp_ns,))[0])
            world.step((0.0, 0.0))
        assert (obs.stamp_ns - stamps[-1]) // tick_ns == ticks


def test_a_world_that_begins_anew_has_no_scan_of_the_last_one() -> None:
    observe = LidarPerception("lidar", 3)
    for _ in range(2):
        world = world_of("lidar")
        assert observe(world, SENSOR).sensed is None
        world.step((0.5, 0.5))
        obs = observe(world, SENSOR)
        assert obs.sensed == (world.stamp_ns - TICK_NS, Pose2D(*CASE.start_m))


def test_further_noise_adds_to_the_robot_s() -> None:
    noise = with_lidar(CASE, "lidar-realistic", 0.03).robot.noise
    assert noise.scan_m == pytest.approx((0.02**2 + 0.03**2) ** 0.5)
    assert noise.odom_m == 0.02
    assert with_lidar(CASE, "lidar", 0.03).robot.noise.scan_m == 0.03


def test_a_negative_latency_is_refused() -> None:
    with pytest.raises(ConfigError, match="latency_ticks=-1: give a whole number"):
        LidarPerception("lidar", -1)
