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
from mfba_planner.perception.obstacle_tracker import Tracker, TrackingParams
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
        assert (circle.radius_m, circle.velocity_mps) == (0.31, (0.0, 0.0))


def test_a_track_without_returns_is_dropped() -> None:
    tracker, empty = Tracker(), scan_of((0.0, 0.0), [], 360, 0.0)
    tracker.update(TICK_NS, Pose2D(0.0, 0.0), scan_of((0.0, 0.0), [(0.8, 0.0, 0.3)], 360, 0.0))
    assert len(tracker.circles(TICK_NS, 0.3)) == 1
    for k in range(2, 40):
        tracker.update(k * TICK_NS, Pose2D(0.0, 0.0), empty)
    assert tracker.circles(40 * TICK_NS, 0.3) == ()


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
