# SPDX-License-Identifier: Apache-2.0
"""A lidar beside the robot's centre, turned and upside down: the same world as a straight one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from mounted_lidars import MOUNTED, OFFSET_M, posts, wall_points, wall_scan

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.lidar_extrinsics import LidarExtrinsics
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.near_returns import blind_ring, near_at_contact
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.scan_coverage import ScanCoverage
from mfba_planner.perception.scan_to_sectors import aligned, sense_scan
from mfba_planner.perception.sensory_vector import SensorParams, sensory_vector
from mfba_planner.recording.perceived import returns_of
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.simulated_lidar import scan_at

RADIUS_M, SENSOR = 0.3, SensorParams()
POSE = Pose2D(2.0, -1.0, 0.4)
EACH = pytest.mark.parametrize("mounted", MOUNTED.values(), ids=MOUNTED)


@EACH
def test_the_same_wall_gives_the_same_sectors(mounted: LidarExtrinsics) -> None:
    assert len(posts()) > 20
    expected = sense_scan(wall_scan(MOUNTED["straight"]), POSE.yaw, RADIUS_M, SENSOR)
    found = sense_scan(wall_scan(mounted), POSE.yaw, RADIUS_M, SENSOR, mounted)
    assert 2 < sum(sensory_vector(expected)) < 9
    assert sensory_vector(found) == sensory_vector(expected)
    assert found == pytest.approx(expected, rel=1e-6)
    if mounted != MOUNTED["straight"]:
        as_if_straight = sense_scan(wall_scan(mounted), POSE.yaw, RADIUS_M, SENSOR)
        assert as_if_straight != pytest.approx(expected, rel=1e-3)


@EACH
def test_the_same_wall_gives_the_same_returns(mounted: LidarExtrinsics) -> None:
    points = returns_of(aligned(wall_scan(mounted), POSE.yaw, mounted), POSE)
    expected = wall_points(POSE)
    away = np.linalg.norm(points[:, None] - expected, axis=2)
    assert len(points) == len(expected)
    assert away.min(axis=0).max() < 1e-5
    assert away.min(axis=1).max() < 1e-5


def test_obstacles_are_tracked_where_they_are() -> None:
    """A disc that stands and one that moves, by a lidar that is 0.3 m ahead and upside down."""
    lidar = Lidar(beams=360, x_m=OFFSET_M, y_m=-0.1, yaw_rad=1.0, flipped=True)
    tracker = Tracker()
    for k in range(20):
        pose = Pose2D(0.02 * k, 0.0, 0.03 * k)
        discs = [(2.0, 0.5, 0.2), (1.0 + 0.04 * k, -1.2, 0.2)]
        scan = aligned(scan_at(pose, lidar, discs, None), pose.yaw, lidar.extrinsics)
        tracker.update(k * 100_000_000, scan.taken_from(pose), scan)
    standing, moving = sorted(tracker.tracks, key=lambda track: track.moving)
    assert standing.center_m == pytest.approx(discs[0][:2], abs=0.01)
    assert standing.velocity_mps == (0.0, 0.0)
    assert moving.center_m == pytest.approx(discs[1][:2], abs=0.03)
    assert moving.velocity_mps == pytest.approx((0.4, 0.0), abs=0.05)


def half_turn(count: int = 180, increment_rad: float = math.radians(1.0)) -> Scan:
    """Free space ahead of the lidar: 90 degrees to both sides."""
    return Scan(
        ranges_m=np.full(count, np.inf),
        angle_min_rad=-0.5 * increment_rad * (count - 1),
        angle_increment_rad=increment_rad,
        range_min_m=0.1,
        range_max_m=3.5,
    )


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize(("x_m", "uncovered"), [(0.0, 6), (-0.45, 4), (0.45, 6)])
def test_which_sectors_a_lidar_beside_the_centre_covers(
    x_m: float, uncovered: int, flipped: bool
) -> None:
    """From 0.45 m behind, its last beams reach the ring of 1 m at 117 degrees, of sector 4."""
    ranges = sense_scan(
        half_turn(), 0.0, RADIUS_M, SENSOR, LidarExtrinsics(x_m=x_m, flipped=flipped)
    )
    assert ranges.count(0.0) == uncovered
    assert ranges == ranges[::-1]


@pytest.mark.parametrize("first_rad", [0.0, 2.0])
def test_a_full_turn_beside_the_centre_covers_every_heading(first_rad: float) -> None:
    scan = half_turn(359)  # one beam is missing, not a direction
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, aligned(scan, first_rad, LidarExtrinsics(x_m=0.4, y_m=0.2)))
    assert coverage.uncovered(0) is None


def test_a_blind_ring_around_a_lidar_beside_the_centre() -> None:
    scan = replace(half_turn(), range_min_m=0.2)
    ahead = aligned(scan, 1.0, LidarExtrinsics(x_m=0.15, y_m=0.2))
    assert blind_ring(scan, RADIUS_M) == ""
    assert blind_ring(ahead, 0.45) == ""
    assert "0.25 m from the robot's centre, is beyond robot_radius_m=0.3" in blind_ring(
        ahead, RADIUS_M
    )
    assert "set robot_radius_m to 0.45" in blind_ring(ahead, RADIUS_M)
    near = replace(ahead, ranges_m=np.array([-np.inf, 0.1, 0.2]))
    at_contact = near_at_contact(near, RADIUS_M)
    assert at_contact.range_min_m == pytest.approx(0.05)
    assert at_contact.ranges_m.tolist() == pytest.approx([-np.inf, np.nan, 0.2], nan_ok=True)


def test_an_offset_that_is_not_finite_is_refused() -> None:
    with pytest.raises(Exception, match="unusable"):
        sense_scan(half_turn(), 0.0, RADIUS_M, SENSOR, LidarExtrinsics(x_m=math.nan))


def test_parameters_and_back() -> None:
    mounted = LidarExtrinsics(0.1, -0.2, 0.3, flipped=True)
    assert mounted.parameters == {
        "scan_x": 0.1, "scan_y": -0.2, "scan_yaw": 0.3, "scan_flipped": True,
    }  # fmt: skip
    assert LidarExtrinsics.of_parameters(mounted.parameters) == mounted
    assert LidarExtrinsics.of_parameters({"scan_yaw": 1}) == LidarExtrinsics(yaw_rad=1.0)
