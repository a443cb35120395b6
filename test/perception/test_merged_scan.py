# SPDX-License-Identifier: Apache-2.0
"""Scans of several lidars become one: the same world, and no more of it than they have seen."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mounted_lidars import FRONT, MOUNTED, REAR, front_scan, rear_scan, wall_points, wall_scan

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Pose2D, ray_circle_distance, relative_pose
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.merged_scan import PlacedScan, merged_scan
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.scan_coverage import ScanCoverage, usable_beams
from mfba_planner.perception.scan_to_sectors import aligned, require_usable, sense_scan
from mfba_planner.perception.sensory_vector import SensorParams, sensory_vector
from mfba_planner.recording.perceived import returns_of
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.simulated_lidar import scan_at

RADIUS_M, SENSOR = 0.3, SensorParams()
POSE = Pose2D(2.0, -1.0, 0.4)
CORNERS = (
    Lidar(beams=360, x_m=0.25, y_m=0.2, yaw_rad=0.8),
    Lidar(beams=360, x_m=-0.25, y_m=-0.2, yaw_rad=-2.3, flipped=True),
)


def parts() -> list[PlacedScan]:
    return [
        PlacedScan(aligned(front_scan(), 0.0, FRONT)),
        PlacedScan(aligned(rear_scan(), 0.0, REAR)),
    ]


def scan_in_base(lidar: Lidar, pose: Pose2D, discs: list[tuple[float, float, float]]) -> Scan:
    """A scan in the robot's frame."""
    return aligned(scan_at(pose, lidar, discs, None), 0.0, lidar.extrinsics)


def half(scan: Scan, first: int) -> Scan:
    """A scan of which only half the beams, from the first on, tell anything."""
    ranges = np.array(scan.ranges_m)
    ranges[(first + np.arange(180, 360)) % 360] = np.nan
    return replace(scan, ranges_m=ranges)


@pytest.mark.parametrize("sequence", [(0, 1), (1, 0)])
def test_the_same_wall_gives_the_same_sectors(sequence: tuple[int, int]) -> None:
    merged = merged_scan([parts()[k] for k in sequence], RADIUS_M)
    expected = sense_scan(wall_scan(MOUNTED["straight"]), POSE.yaw, RADIUS_M, SENSOR)
    found = sense_scan(merged, POSE.yaw, RADIUS_M, SENSOR)
    assert sensory_vector(found) == sensory_vector(expected)
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("k", [0, 1])
def test_one_of_them_alone_does_not_know_the_rest(k: int) -> None:
    found = sense_scan(merged_scan(parts()[k : k + 1], RADIUS_M), POSE.yaw, RADIUS_M, SENSOR)
    assert 3 < found.count(0.0) < 8
    assert ScanCoverage(36, 0.2).uncovered(0) is not None


def test_the_same_wall_gives_the_same_returns() -> None:
    points = returns_of(aligned(merged_scan(parts(), RADIUS_M), POSE.yaw), POSE)
    away = np.linalg.norm(points[:, None] - wall_points(POSE), axis=2)
    assert away.min(axis=0).max() < 1e-5
    assert away.min(axis=1).max() < 1e-5


def test_all_directions_are_covered_by_the_two_together() -> None:
    merged = merged_scan(parts(), RADIUS_M)
    coverage = ScanCoverage(36, 0.2)
    coverage.update(1, aligned(merged, POSE.yaw))
    assert coverage.uncovered(1) is None
    assert merged.range_max_m == pytest.approx(3.2), "as far as both see all around"


DISCS = st.lists(
    st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.05, 0.6)).filter(
        lambda disc: math.hypot(*disc[:2]) > disc[2] + 0.6
    ),
    max_size=6,
)


@settings(max_examples=60, deadline=None)
@given(DISCS)
def test_nothing_is_free_that_is_not(discs: list[tuple[float, float, float]]) -> None:
    """Returns are on the discs, and beams that met nothing pass them all but for grazing."""
    pose = Pose2D(0.0, 0.0)
    merged = merged_scan(
        [PlacedScan(scan_in_base(each, pose, discs)) for each in CORNERS], RADIUS_M
    )
    ranges = np.asarray(merged.ranges_m)
    angles = merged.angles_rad(np.arange(ranges.size))
    for x, y, r in discs:
        away, bearing = math.hypot(x, y), math.atan2(y, x)
        for range_m, angle in zip(ranges.tolist(), angles.tolist()):
            if math.isnan(range_m):
                continue
            off = math.remainder(angle - bearing, 2.0 * math.pi)
            # Thinner by what a lidar may miss between two of its beams.
            met = ray_circle_distance(away, r - math.radians(1.0) * (away + 0.4), off)
            assert min(range_m, merged.range_max_m) <= max(met, away - r) + 0.12 or met > 3.0
    points = returns_of(merged, pose)
    if len(points):
        centers, radii = np.array([d[:2] for d in discs]), np.array([d[2] for d in discs])
        from_disc = np.linalg.norm(points[:, None] - centers, axis=2) - radii
        assert from_disc.min(axis=1).max() < 0.05
        assert from_disc.min() > -0.05


def test_obstacles_are_tracked_where_they_are() -> None:
    """A disc that stands and one that moves, by two lidars at the corners of a robot."""
    tracker = Tracker()
    for k in range(20):
        pose = Pose2D(0.02 * k, 0.0, 0.03 * k)
        discs = [(2.0, 0.5, 0.2), (1.0 + 0.04 * k, -1.2, 0.2)]
        lidars = [PlacedScan(scan_in_base(lidar, pose, discs)) for lidar in CORNERS]
        scan = aligned(merged_scan(lidars, RADIUS_M), pose.yaw)
        tracker.update(k * 100_000_000, scan.taken_from(pose), scan)
    standing, moving = sorted(tracker.tracks, key=lambda track: track.moving)
    assert (standing.moving, moving.moving) == (False, True)
    assert standing.center_m == pytest.approx((2.0, 0.5), abs=0.02)
    assert moving.center_m == pytest.approx((1.76, -1.2), abs=0.03)
    assert moving.velocity_mps == pytest.approx((0.4, 0.0), abs=0.03)


def test_an_older_scan_is_brought_to_where_the_robot_is_now() -> None:
    disc = [(1.5, 0.4, 0.2)]
    before, now = Pose2D(0.0, 0.0), Pose2D(0.1, 0.05, 0.3)
    old = PlacedScan(scan_in_base(CORNERS[0], before, disc), relative_pose(before, now))
    points = returns_of(aligned(merged_scan([old], RADIUS_M), now.yaw), now)
    assert len(points) > 5
    assert np.abs(np.linalg.norm(points - disc[0][:2], axis=1) - 0.2).max() < 2e-3


def test_beams_of_a_scan_that_takes_time_are_where_the_lidar_was() -> None:
    """A robot that turns and drives while one lidar turns once in 0.1 s."""
    velocity, lidar, disc = (0.5, 0.0, 0.8), CORNERS[0], [(0.2, 1.5, 0.3)]
    step_s, ranges = 0.1 / 360, []
    for k in range(360):
        t = k * step_s
        yaw = velocity[2] * t
        pose = Pose2D(velocity[0] * t, 0.0, yaw)
        ranges.append(float(scan_at(pose, lidar, disc, None).ranges_m[k]))
    raw = replace(
        scan_at(Pose2D(0.0, 0.0), lidar, disc, None),
        ranges_m=np.array(ranges),
        time_increment_s=step_s,
    )
    part = PlacedScan(aligned(raw, 0.0, lidar.extrinsics), velocity=velocity)
    points = returns_of(merged_scan([part], RADIUS_M), Pose2D(0.0, 0.0))
    assert np.abs(np.linalg.norm(points - disc[0][:2], axis=1) - 0.3).max() < 2e-3
    still = returns_of(merged_scan([part._replace(velocity=(0.0,) * 3)], RADIUS_M), Pose2D(0, 0))
    assert np.abs(np.linalg.norm(still - disc[0][:2], axis=1) - 0.3).max() > 6e-3


def test_of_two_returns_in_one_direction_the_nearest_counts() -> None:
    pose = Pose2D(0.0, 0.0)
    near = scan_in_base(CORNERS[0], pose, [(1.0, 0.0, 0.2)])
    far = scan_in_base(CORNERS[1], pose, [(2.0, 0.0, 0.2)])
    for both in ([near, far], [far, near]):
        merged = merged_scan([PlacedScan(scan) for scan in both], RADIUS_M)
        assert merged.ranges_m[0] == pytest.approx(0.8, abs=0.01)


def test_a_surface_between_two_returns_is_met_by_the_beams_between_them() -> None:
    """A wall 0.5 m ahead of the robot, from a lidar 1 m behind: three beams to a lidar's one."""
    lidar = Lidar(beams=360, x_m=-1.0)
    scan = scan_in_base(lidar, Pose2D(0.0, 0.0), [])
    angles = scan.angles_rad(np.arange(360))
    ahead = np.cos(angles) > 0.9
    ranges = np.where(ahead, 1.5 / np.where(ahead, np.cos(angles), 1.0), np.inf)
    merged = merged_scan([PlacedScan(replace(scan, ranges_m=ranges))], RADIUS_M)
    bearing = merged.angles_rad(np.arange(360))
    wall = np.cos(bearing) > math.cos(math.atan(1.5 * math.tan(math.acos(0.9)) / 0.5) - 0.03)
    assert np.count_nonzero(wall) > 100
    assert merged.ranges_m[wall] == pytest.approx(0.5 / np.cos(bearing[wall]), abs=1e-9)


def test_a_surface_between_returns_is_ahead_and_within_range() -> None:
    """Of what lies between two returns, the part behind the merged range is not met."""
    lidar = Lidar(beams=360, x_m=-1.0, range_max_m=3.5)
    scan = scan_in_base(lidar, Pose2D(0.0, 0.0), [])
    angles = scan.angles_rad(np.arange(360))
    ahead = np.cos(angles) > 0.9
    ranges = np.where(ahead, 3.4 / np.where(ahead, np.cos(angles), 1.0), np.inf)
    merged = merged_scan([PlacedScan(replace(scan, ranges_m=ranges))], RADIUS_M)
    assert merged.range_max_m == 2.5
    returns = merged.ranges_m[np.isfinite(merged.ranges_m)]
    assert returns.size > 30
    assert returns.max() <= merged.range_max_m


def test_what_is_too_near_for_a_lidar_touches_the_robot() -> None:
    scan = replace(wall_scan(MOUNTED["ahead"]), range_min_m=0.2)
    scan.ranges_m[0] = -math.inf
    merged = merged_scan([PlacedScan(aligned(scan, 0.0, MOUNTED["ahead"]))], RADIUS_M)
    assert merged.ranges_m[0] <= RADIUS_M + 1e-9


def test_a_lidar_that_tells_nothing_tells_nothing() -> None:
    nothing = replace(rear_scan(), ranges_m=np.full(360, np.nan))
    front, merged = parts()[:1], merged_scan([parts()[0], PlacedScan(nothing)], RADIUS_M)
    alone = merged_scan(front, RADIUS_M)
    assert (usable_beams(merged) == usable_beams(alone)).all()


def test_half_a_lidar_beside_the_centre_covers_what_is_beyond_its_own_line() -> None:
    """Beams to the left of a lidar ahead do not tell what is beside the robot's centre."""
    ahead = replace(half(front_scan(), 270), ranges_m=np.full(360, np.inf))
    ahead = half(ahead, 270)
    merged = merged_scan([PlacedScan(aligned(ahead, 0.0, FRONT))], RADIUS_M)
    known = usable_beams(merged)
    assert known[:70].all()
    assert not known[76:285].any()


NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(NUMBERS, min_size=1, max_size=40), st.floats(-7.0, 7.0),
    st.floats(-0.5, 0.5) | st.just(1e-30), st.floats(0.0, 1.0),
    st.floats(1.1, 1e300) | st.just(math.inf), st.floats(-1.0, 1.0),
)  # fmt: skip
def test_odd_scans_make_a_scan_that_can_be_measured(
    ranges: list[float],
    first: float,
    step: float,
    least: float,
    most: float,
    x: float,
) -> None:
    scan = Scan(
        ranges_m=np.array(ranges), angle_min_rad=first, angle_increment_rad=step,
        range_min_m=least, range_max_m=most, origin_m=(x, -x), time_increment_s=0.005 * abs(x),
    )  # fmt: skip
    try:
        known = require_usable(scan, 0.0, scan.origin_m)
    except InputError:
        return
    merged = merged_scan([PlacedScan(scan, Pose2D(0.1, x, x), (x, 0.3, x))], RADIUS_M)
    assert not np.isneginf(merged.ranges_m).any()
    assert merged.range_min_m < merged.range_max_m < 1e4
    assert (usable_beams(merged) == ~np.isnan(merged.ranges_m)).all()
    if usable_beams(merged).any():
        sense_scan(merged, 0.3, RADIUS_M, SENSOR)
        Tracker().update(1, Pose2D(0.0, 0.0), aligned(merged, 0.3))
    assert known.any()
