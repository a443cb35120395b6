# SPDX-License-Identifier: Apache-2.0
"""Tracker against circles of known motion: positions, velocities, turns, shapes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Circle, Scan
from mfba_planner.perception.obstacle_tracker import Track, Tracker, TrackingParams
from mfba_planner.simulation.simulated_lidar import cast_rays

TICK_NS = 100_000_000
LONGEST_M = 1.1


def scan_of(
    robot_position: Point,
    circles: list[tuple[float, float, float]],
    beams: int,
    noise: np.ndarray | float,
) -> Scan:
    increment = 2.0 * math.pi / beams
    return Scan(
        ranges_m=cast_rays(robot_position, circles, beams, LONGEST_M) + noise,
        angle_min_rad=0.5 * increment,
        angle_increment_rad=increment,
        range_min_m=0.0,
        range_max_m=LONGEST_M + 0.1,
    )


def track_circle(
    start: Point,
    velocity: Point,
    beams: int,
    ticks: int,
    *,
    noise_m: float = 0.0,
    robot: Point = (0.0, 0.0),
    turns_at: int = 10**9,
) -> list[tuple[Circle, ...]]:
    """The tracked circles of each tick; the obstacle of 0.3 m turns back at tick turns_at."""
    tracker, rng = Tracker(), np.random.default_rng(7)
    (x, y), (vx, vy) = start, velocity
    tracked = []
    for k in range(ticks):
        t = k * TICK_NS * 1e-9
        along = t if k <= turns_at else (2 * turns_at - k) * TICK_NS * 1e-9
        robot_position = (robot[0] * t, robot[1] * t)
        noise = rng.normal(0.0, noise_m, beams) if noise_m else 0.0
        scan = scan_of(robot_position, [(x + vx * along, y + vy * along, 0.3)], beams, noise)
        tracker.update((k + 1) * TICK_NS, Pose2D(*robot_position), scan)
        tracked.append(tracker.circles((k + 1) * TICK_NS, 0.3))
    return tracked


@given(
    bearing_rad=st.floats(-math.pi, math.pi),
    heading_rad=st.floats(-math.pi, math.pi),
    speed=st.floats(0.0, 0.3),
)
@settings(max_examples=40)
def test_noiseless_scans_give_position_and_velocity(
    bearing_rad: float, heading_rad: float, speed: float
) -> None:
    start = (0.9 * math.cos(bearing_rad), 0.9 * math.sin(bearing_rad))
    velocity = (speed * math.cos(heading_rad), speed * math.sin(heading_rad))
    (circle,) = track_circle(start, velocity, 360, 8)[-1]
    truth = (start[0] + 0.7 * velocity[0], start[1] + 0.7 * velocity[1])
    assert math.dist(circle.center_m, truth) < 0.02
    slow = circle.velocity_mps == (0.0, 0.0) and speed < 0.15
    assert slow or math.dist(circle.velocity_mps, velocity) < 0.04
    assert 0.6 <= circle.radius_m < 0.7


@pytest.mark.parametrize(("beams", "tolerance"), [(360, 0.06), (36, 0.12)])
def test_velocity_and_position_with_2_cm_of_noise_and_few_beams(
    beams: int, tolerance: float
) -> None:
    (circle,) = track_circle((0.9, -0.4), (-0.05, 0.25), beams, 25, noise_m=0.02)[-1]
    assert math.dist(circle.velocity_mps, (-0.05, 0.25)) < tolerance
    assert math.dist(circle.center_m, (0.9 - 0.12, -0.4 + 0.6)) < tolerance


def test_a_moving_robot_measures_the_obstacle_s_velocity_not_its_own() -> None:
    (circle,) = track_circle((1.0, 0.9), (0.1, -0.2), 360, 12, robot=(0.5, 0.0))[-1]
    assert math.dist(circle.velocity_mps, (0.1, -0.2)) < 0.03


def test_an_obstacle_that_turns_back_is_tracked_within_half_a_second() -> None:
    tracked = track_circle((0.9, -0.4), (0.0, 0.3), 360, 16, turns_at=10)
    (before,), (after,) = tracked[10], tracked[15]
    assert before.velocity_mps[1] == pytest.approx(0.3, abs=0.03)
    assert after.velocity_mps[1] == pytest.approx(-0.3, abs=0.1)


def test_two_obstacles_give_two_tracks() -> None:
    tracker = Tracker()
    for k in range(8):
        t = 0.1 * k
        circles = [(0.8, 0.3 + 0.2 * t, 0.3), (-0.9, 0.1 - 0.3 * t, 0.3)]
        tracker.update((k + 1) * TICK_NS, Pose2D(0.0, 0.0), scan_of((0.0, 0.0), circles, 360, 0.0))
    left, right = sorted(tracker.circles(8 * TICK_NS, 0.3), key=lambda c: c.center_m[0])
    assert math.dist(left.velocity_mps, (0.0, -0.3)) < 0.04
    assert math.dist(right.velocity_mps, (0.0, 0.2)) < 0.04


def test_a_wall_gives_points_at_rest() -> None:
    angles = (np.arange(360) + 0.5) * (2.0 * math.pi / 360)
    with np.errstate(divide="ignore"):
        ranges = np.where(np.cos(angles) > 0.35, 0.5 / np.cos(angles), np.inf)
    tracker = Tracker()
    scan = Scan(
        ranges_m=ranges,
        angle_min_rad=float(angles[0]),
        angle_increment_rad=2.0 * math.pi / 360,
        range_min_m=0.0,
        range_max_m=2.0,
    )
    tracker.update(TICK_NS, Pose2D(1.0, 2.0), scan)
    circles = tracker.circles(TICK_NS, 0.3)
    assert len(circles) > 10
    for circle in circles:
        assert circle.center_m[0] == pytest.approx(1.5)
        assert (circle.radius_m, circle.velocity_mps) == (0.305, (0.0, 0.0))


def test_a_track_without_returns_is_dropped() -> None:
    tracker, empty = Tracker(), scan_of((0.0, 0.0), [], 360, 0.0)
    tracker.update(TICK_NS, Pose2D(0.0, 0.0), scan_of((0.0, 0.0), [(0.8, 0.0, 0.3)], 360, 0.0))
    assert len(tracker.circles(TICK_NS, 0.3)) == 1
    for k in range(2, 40):
        tracker.update(k * TICK_NS, Pose2D(0.0, 0.0), empty)
    assert tracker.circles(40 * TICK_NS, 0.3) == ()


@pytest.mark.parametrize(
    ("visible", "kept"),
    [
        ("y-", False),  # known for less than three scans
        ("yy-", False),
        ("yyy-", True),
        ("yyy--", False),
        ("yyyyyy-", True),
        ("yyyyyy--", False),
        ("yyyyyy-y-", True),  # not in a row
        ("yyyyyy-y--", False),
    ],
)
def test_a_track_is_dropped_when_two_scans_in_a_row_see_through_it(
    visible: str, kept: bool
) -> None:
    tracker = Tracker()
    for k, now in enumerate(visible, start=1):
        circles = [(0.8, 0.0, 0.3)] if now == "y" else []
        tracker.update(k * TICK_NS, Pose2D(0.0, 0.0), scan_of((0.0, 0.0), circles, 360, 0.0))
    assert (tracker.circles(len(visible) * TICK_NS, 0.3) != ()) == kept


def test_circles_are_predicted_to_now() -> None:
    tracker = Tracker()
    for k in range(8):
        circle = (0.9, -0.3 + 0.03 * k, 0.3)
        tracker.update((k + 1) * TICK_NS, Pose2D(0.0, 0.0), scan_of((0.0, 0.0), [circle], 360, 0))
    (then,), (now,) = tracker.circles(8 * TICK_NS, 0.3), tracker.circles(10 * TICK_NS, 0.3)
    assert now.center_m[1] - then.center_m[1] == pytest.approx(0.06, abs=0.01)


def test_an_older_stamp_drops_all_tracks() -> None:
    tracker = Tracker()
    scan = scan_of((0.0, 0.0), [(0.8, 0.0, 0.3)], 360, 0.0)
    tracker.update(5 * TICK_NS, Pose2D(0.0, 0.0), scan)
    tracker.update(TICK_NS, Pose2D(0.0, 0.0), scan_of((0.0, 0.0), [(-0.8, 0.0, 0.3)], 360, 0.0))
    (circle,) = tracker.circles(TICK_NS, 0.3)
    assert circle.center_m[0] < 0.0


def test_nan_and_too_long_ranges_are_no_returns() -> None:
    ranges = np.full(12, np.nan)
    ranges[3] = 50.0
    scan = Scan(
        ranges_m=ranges,
        angle_min_rad=0.0,
        angle_increment_rad=math.pi / 6.0,
        range_min_m=0.0,
        range_max_m=10.0,
    )
    tracker = Tracker()
    tracker.update(TICK_NS, Pose2D(0.0, 0.0), scan)
    assert tracker.circles(TICK_NS, 0.3) == ()


def test_options_are_checked() -> None:
    with pytest.raises(ConfigError, match=r"range_sd_m=0\.0: out of range"):
        TrackingParams(range_sd_m=0.0)


Moving = tuple[float, float, float, float, float]  # x, y, vx, vy, r


def run_tracker(
    obstacles: list[Moving],
    ticks: int,
    *,
    beams: int = 360,
    frame: tuple[float, float, float] = (0.0, 0.0, 0.0),
    scan_m: float = 0.0,
    odom: tuple[float, float] = (0.0, 0.0),
    seed: int = 0,
    before: int = 0,
) -> Tracker:
    """Track discs from the origin of a frame (x, y, yaw) in odom; 10 m, a scan every 0.1 s.

    The first disc is not there during the first `before` scans.
    """
    tracker, rng, increment = Tracker(), np.random.default_rng(seed), 2.0 * math.pi / beams
    for k in range(ticks):
        t = 0.1 * (k - before)
        there = obstacles[1:] if k < before else obstacles
        discs = [(x + vx * t, y + vy * t, r) for x, y, vx, vy, r in there]
        dx, dy = rng.normal(0.0, odom[0], 2) if odom[0] else (0.0, 0.0)
        turn = rng.normal(0.0, odom[1]) if odom[1] else 0.0
        noise = rng.normal(0.0, scan_m, beams) if scan_m else 0.0
        scan = Scan(
            ranges_m=cast_rays((0.0, 0.0), discs, beams, 10.0) + noise,
            angle_min_rad=0.5 * increment + frame[2] + turn,
            angle_increment_rad=increment,
            range_min_m=0.0,
            range_max_m=10.5,
        )
        tracker.update((k + 1) * TICK_NS, Pose2D(frame[0] + dx, frame[1] + dy, frame[2]), scan)
    return tracker


def track_at(tracker: Tracker, place: Point) -> Track:
    """The track nearest to a place."""
    return min(tracker.tracks, key=lambda track: math.dist(track.center_m, place))


@given(radius=st.floats(0.05, 1.0), bearing=st.floats(-math.pi, math.pi))
@settings(max_examples=40, deadline=None)
def test_radii_from_a_pole_to_a_column_are_found(radius: float, bearing: float) -> None:
    d = 1.5 + radius
    place = (d * math.cos(bearing), d * math.sin(bearing))
    track = track_at(run_tracker([(*place, 0.0, 0.0, radius)], 4), place)
    assert track.radius_m == pytest.approx(radius, abs=0.03)
    assert math.dist(track.center_m, place) < 0.04


@given(
    discs=st.lists(st.tuples(st.floats(1.2, 4.0), st.floats(0.05, 0.5)), min_size=1, max_size=4),
    seed=st.integers(0, 1000),
)
@settings(max_examples=25, deadline=None)
def test_what_stands_has_the_velocity_zero(discs: list[tuple[float, float]], seed: int) -> None:
    obstacles: list[Moving] = []
    for k, (away, r) in enumerate(discs):
        angle, d = 0.5 * math.pi * k + 0.3, away + r
        obstacles.append((d * math.cos(angle), d * math.sin(angle), 0.0, 0.0, r))
    tracker = run_tracker(obstacles, 12, scan_m=0.01, seed=seed)
    assert {circle.velocity_mps for circle in tracker.circles(12 * TICK_NS, 0.3)} == {(0.0, 0.0)}


def test_what_stands_has_the_velocity_zero_beside_an_odometry_that_errs() -> None:
    places = [(2.0, 0.5), (-1.0, 2.5), (-2.0, -1.0), (0.5, -3.0), (3.0, 3.0)]
    obstacles = [(x, y, 0.0, 0.0, 0.25) for x, y in places]
    for seed in range(5):
        tracker = run_tracker(obstacles, 25, scan_m=0.02, odom=(0.02, 0.02), seed=seed)
        assert not any(track.moving for track in tracker.tracks)


@pytest.mark.parametrize(("speed", "scans"), [(0.3, 5), (1.0, 3), (2.5, 3)])
def test_a_new_obstacle_has_its_velocity_after_three_scans(speed: float, scans: int) -> None:
    columns = [(-2.0, 0.0, 0.0, 0.0, 0.3), (0.0, -2.0, 0.0, 0.0, 0.2), (-1.0, 3.0, 0.0, 0.0, 0.1)]
    for bearing in np.linspace(-3.0, 3.0, 7).tolist():
        vx, vy = speed * math.cos(bearing), speed * math.sin(bearing)
        tracker = run_tracker([(3.0, 1.0, vx, vy, 0.25), *columns], 12 + scans, before=12)
        t = 0.1 * (scans - 1)
        track = track_at(tracker, (3.0 + vx * t, 1.0 + vy * t))
        assert track.moving
        off = math.dist(track.velocity_mps, (vx, vy))
        assert off < max(0.15, 0.15 * speed)
        assert off < 4.0 * track.velocity_sd_mps


def test_two_people_abreast_stay_two() -> None:
    for gap in (0.0, 0.1, 0.3):
        half = 0.25 + 0.5 * gap
        people = [(3.5, half, -1.2, 0.0, 0.25), (3.5, -half, -1.2, 0.0, 0.25)]
        for ticks in (4, 8, 15):
            tracker = run_tracker(people, ticks)
            x = 3.5 - 0.12 * (ticks - 1)
            one, other = track_at(tracker, (x, half)), track_at(tracker, (x, -half))
            assert one.center_m != other.center_m
            for track in (one, other):
                assert track.radius_m < 0.33
                assert math.dist(track.velocity_mps, (-1.2, 0.0)) < 0.25


def test_a_turned_and_moved_frame_gives_turned_and_moved_tracks() -> None:
    obstacles = [
        (2.0, 0.5, 0.4, -0.3, 0.3),
        (-1.0, 2.0, 0.0, 0.0, 0.1),
        (-3.0, -1.0, 0.0, 1.0, 0.5),
    ]
    plain = run_tracker(obstacles, 8).tracks
    x, y, yaw = 3.0, -2.0, 0.7
    turned = run_tracker(obstacles, 8, frame=(x, y, yaw)).tracks
    assert len(plain) == len(turned)
    c, s = math.cos(yaw), math.sin(yaw)
    for before, after in zip(plain, turned):
        (px, py), (vx, vy) = before.center_m, before.velocity_mps
        assert after.center_m == pytest.approx(
            (x + c * px - s * py, y + s * px + c * py), abs=1e-6
        )
        assert after.velocity_mps == pytest.approx((c * vx - s * vy, s * vx + c * vy), abs=1e-5)
        assert after.radius_m == pytest.approx(before.radius_m, abs=1e-6)


def test_the_same_scans_give_the_same_tracks_bit_for_bit() -> None:
    obstacles = [(2.0, 0.5, 0.4, -0.3, 0.3), (-1.0, 2.0, 0.0, 0.0, 0.1)]
    one, other = (run_tracker(obstacles, 9, scan_m=0.02, seed=3).tracks for _ in range(2))
    assert one == other


def test_every_return_lies_within_a_circle() -> None:
    rng = np.random.default_rng(8)
    ranges = np.where(rng.random(360) < 0.3, np.inf, rng.uniform(0.3, 5.0, 360))
    tracker, increment = Tracker(), 2.0 * math.pi / 360
    scan = Scan(
        ranges_m=ranges,
        angle_min_rad=0.0,
        angle_increment_rad=increment,
        range_min_m=0.1,
        range_max_m=10.0,
    )
    tracker.update(TICK_NS, Pose2D(0.0, 0.0), scan)
    circles = tracker.circles(TICK_NS, 0.3)
    for k, r in enumerate(ranges.tolist()):
        if math.isfinite(r):
            point = (r * math.cos(k * increment), r * math.sin(k * increment))
            assert min(math.dist(point, c.center_m) - c.radius_m for c in circles) < 0.0


def test_a_scan_that_takes_time_gives_the_place_at_its_stamp() -> None:
    speed, per_beam_s, increment = 2.0, 2e-4, 2.0 * math.pi / 360
    errors = []
    for stated in (per_beam_s, 0.0):
        tracker = Tracker()
        for k in range(8):
            ranges = np.full(360, np.inf)
            for beam in range(360):  # each beam meets the disc where it is then
                t = 0.1 * k + beam * per_beam_s
                disc = (-1.0 + speed * t, -2.0, 0.3)
                ranges[beam] = cast_rays((0.0, 0.0), [disc], 360, 10.0)[beam]
            scan = Scan(
                ranges_m=ranges,
                angle_min_rad=0.5 * increment,
                angle_increment_rad=increment,
                range_min_m=0.0,
                range_max_m=10.5,
                time_increment_s=stated,
            )
            tracker.update((k + 1) * TICK_NS, Pose2D(0.0, 0.0), scan)
        (circle,) = tracker.circles(8 * TICK_NS, 0.0)
        errors.append(math.dist(circle.center_m, (-1.0 + speed * 0.7, -2.0)))
    assert errors[0] < 0.03
    assert errors[1] > 0.05
