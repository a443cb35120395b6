# SPDX-License-Identifier: Apache-2.0
"""Local map: what stands is in it, what moves is not, and noise does not smear it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mapped_scenes import Disc, Scene, near, off_surface, room, wall

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Scan
from mfba_planner.core.segments import Segments
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.scan_to_sectors import aligned
from mfba_planner.perception.static_map import StaticMap, StaticMapParams
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.simulated_lidar import scan_at

NOISES = [
    pytest.param((0.0, 0.0, 0.0), id="exact"),
    pytest.param((0.01, 0.01, 0.01), id="1 cm"),
    pytest.param((0.02, 0.02, 0.02), id="2 cm"),
]
Noise = tuple[float, float, float]
ROOM = room(4.0)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize(("beams", "reach_m"), [(180, 10.0), (360, 3.5), (1080, 30.0)])
def test_a_wall_of_6_m_has_no_holes_and_no_ghosts(
    noise: Noise, beams: int, reach_m: float
) -> None:
    discs = wall((-1.0, 1.5), (5.0, 1.5))
    scan_m, odom_m, odom_rad = noise
    scene = Scene(
        lambda t: discs, beams=beams, reach_m=reach_m, scan_m=scan_m, odom_m=odom_m,
        odom_rad=odom_rad,
    )  # fmt: skip
    for k in range(50):
        points = scene.step(Pose2D(0.1 * k, 0.0, 0.3))
    off = off_surface(points, discs)
    assert np.abs(off).max() < 0.02 + 6.0 * scan_m
    assert np.quantile(np.abs(off), 0.9) < 0.01 + 1.5 * scan_m
    along = np.sort(np.concatenate(([-1.0, 5.0], points[:, 0])))
    assert np.diff(along).max() < 0.2


@pytest.mark.parametrize("noise", NOISES)
def test_a_door_of_80_cm_stays_open_while_the_robot_passes(noise: Noise) -> None:
    discs = [
        *wall((-3.0, 3.0), (-0.45, 3.0)),
        *wall((0.45, 3.0), (3.0, 3.0)),
        *wall((-3.0, 3.0), (-3.0, -1.0)),
        *wall((3.0, 3.0), (3.0, -1.0)),
        *wall((-2.0, 7.0), (2.0, 7.0)),
        *wall((2.0, 7.0), (2.0, 5.0)),
    ]
    scan_m, odom_m, odom_rad = noise
    scene = Scene(lambda t: discs, scan_m=scan_m, odom_m=odom_m, odom_rad=odom_rad)
    for k in range(55):
        points = scene.step(Pose2D(0.0, 0.1 * k, 0.5 * math.pi))
        door = points[np.abs(points[:, 1] - 3.0) < 0.2]
        if k > 3:
            assert door[door[:, 0] > 0.0, 0].min() - door[door[:, 0] < 0.0, 0].max() >= 0.7
    assert np.abs(off_surface(points, discs)).max() < 0.02 + 6.0 * scan_m


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("speed", [0.3, 0.8, 1.4])
def test_a_walking_person_leaves_no_trail(speed: float, noise: Noise) -> None:
    def discs(t: float) -> list[Disc]:
        return [*ROOM, (-2.5 + speed * t, 2.0, 0.25)]

    scan_m, odom_m, odom_rad = noise
    scene = Scene(discs, scan_m=scan_m, odom_m=odom_m, odom_rad=odom_rad)
    for k in range(round(40.0 / speed)):
        points = scene.step(Pose2D(0.0, 0.0, 0.2))
        if k > 12:  # it is known what moves
            assert np.abs(off_surface(points, ROOM)).max() < 0.2


@pytest.mark.parametrize("noise", NOISES)
def test_a_person_at_rest_is_marked_and_removed_after_leaving(noise: Noise) -> None:
    def discs(t: float) -> list[Disc]:
        return [*ROOM, (-3.0 + t if t < 3.0 else max(t - 7.0, 0.0), 2.0, 0.25)]

    scan_m, odom_m, odom_rad = noise
    scene = Scene(discs, scan_m=scan_m, odom_m=odom_m, odom_rad=odom_rad)
    marked = []
    for _ in range(100):
        marked.append(near(scene.step(Pose2D(0.0, 0.0)), (0.0, 2.0, 0.25), 0.05))
    assert max(marked[:36]) == 0
    assert min(marked[55:70]) >= 5
    assert max(marked[85:]) == 0


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("beams", [180, 360, 1080])
def test_what_goes_away_is_cleared_within_two_scans(beams: int, noise: Noise) -> None:
    gone = [(1.5, 1.5, 0.3), (-1.0, 1.0, 0.05)]
    scan_m, odom_m, odom_rad = noise
    scene = Scene(
        lambda t: [*ROOM, *(gone if t < 1.95 else [])], beams=beams, scan_m=scan_m, odom_m=odom_m,
        odom_rad=odom_rad,
    )  # fmt: skip
    for _ in range(20):
        points = scene.step(Pose2D(0.0, 0.0, 0.2))
    assert all(near(points, disc) for disc in gone)
    for _ in range(4 if scan_m else 2):
        points = scene.step(Pose2D(0.0, 0.0, 0.2))
    assert not any(near(points, disc) for disc in gone)


@pytest.mark.parametrize("noise", NOISES)
def test_thin_poles_stay_between_the_beams(noise: Noise) -> None:
    poles = [(1.5, 0.8, 0.02), (2.5, -0.7, 0.02), (3.5, 1.2, 0.02), (-1.0, -1.0, 0.02)]
    scan_m, odom_m, odom_rad = noise
    scene = Scene(lambda t: [*poles, *room(6.0)], scan_m=scan_m, odom_m=odom_m, odom_rad=odom_rad)
    for k in range(80):
        points = scene.step(Pose2D(0.05 * k, 0.02 * math.sin(k), 0.2 * math.sin(0.3 * k)))
        if k > 20:
            assert all(near(points, pole, 0.2) for pole in poles)


def test_far_movers_leave_nothing_where_beams_are_sparse() -> None:
    def discs(t: float) -> list[Disc]:
        return [(9.0, -3.0 + 1.2 * t, 0.25), (-3.0 + 1.2 * t, 8.5, 0.25)]

    scene = Scene(discs, reach_m=30.0)
    for _ in range(60):
        assert not scene.step(Pose2D(0.0, 0.0)).size


def test_the_odometry_s_error_is_found() -> None:
    scene = Scene(lambda t: ROOM, scan_m=0.01, odom_m=0.02, odom_rad=0.02)
    errors = []
    for k in range(60):
        scene.step(Pose2D(0.02 * k, 0.0, 0.01 * k))
        ahead = scene.given.x + 2.0 * math.cos(scene.given.yaw)
        beside = scene.given.y + 2.0 * math.sin(scene.given.yaw)
        x, y = scene.map.to_map(np.array([ahead]), np.array([beside]))
        truth = (scene.pose.x + 2.0 * math.cos(0.01 * k), scene.pose.y + 2.0 * math.sin(0.01 * k))
        errors.append((float(x[0]) - truth[0], float(y[0]) - truth[1]))
    jitter = np.diff(np.array(errors[10:]), axis=0)  # the frame itself begins with an error
    assert np.abs(jitter).max() < 0.03
    assert np.sqrt((jitter**2).mean()) < 0.008


def test_an_exact_odometry_is_left_alone() -> None:
    scene = Scene(lambda t: [*ROOM, (-2.0 + 0.2 * t, 1.5, 0.3)])
    for k in range(60):
        scene.step(Pose2D(0.03 * k, 0.01 * k, 0.02 * k))
        x, y = scene.map.to_map(np.array([3.0]), np.array([0.0]))
        assert math.hypot(float(x[0]) - 3.0, float(y[0])) < 0.01


def test_beams_that_tell_nothing_clear_nothing() -> None:
    scene = Scene(lambda t: [*ROOM, *([(2.0, 0.0, 0.3)] if t < 0.95 else [])], fov_rad=4.0)
    for _ in range(10):
        scene.step(Pose2D(0.0, 0.0))
    for _ in range(20):  # the disc has gone, but the robot looks the other way
        points = scene.step(Pose2D(0.0, 0.0, math.pi))
    assert near(points, (2.0, 0.0, 0.3)) >= 5
    for _ in range(3):
        points = scene.step(Pose2D(0.0, 0.0))
    assert not near(points, (2.0, 0.0, 0.3))


def test_the_window_rolls_and_the_memory_is_bounded() -> None:
    params = StaticMapParams(size_m=6.0)
    scene = Scene(
        lambda t: [(0.7 * k, (-1.0) ** k, 0.2) for k in range(int(t) - 9, int(t) + 14)],
        beams=180, params=params,
    )  # fmt: skip
    counts = []
    for k in range(600):
        points = scene.step(Pose2D(0.07 * k, 0.0))
        assert np.abs(points - (0.07 * k, 0.0)).max(initial=0.0) <= 3.2
        counts.append(scene.map.count)
    assert max(counts[300:]) <= 1.2 * max(counts[50:300])
    assert max(counts) < 400


@given(
    seed=st.integers(0, 2**32 - 1),
    beams=st.integers(1, 400),
    increment=st.floats(-0.1, 0.1).filter(lambda value: abs(value) > 1e-3),
    time_increment_s=st.sampled_from([0.0, 1e-3]),
)
@settings(max_examples=60, deadline=None)
def test_any_scan_is_taken(
    seed: int, beams: int, increment: float, time_increment_s: float
) -> None:
    rng = np.random.default_rng(seed)
    increment = math.copysign(min(abs(increment), 2.0 * math.pi / beams), increment)
    tracker, local_map, version = Tracker(), StaticMap(StaticMapParams(size_m=8.0)), 0
    for k in range(6):
        ranges = rng.uniform(0.0, 12.0, beams)
        ranges[rng.random(beams) < 0.2] = rng.choice([math.inf, -math.inf, math.nan])
        pose = Pose2D(*rng.normal(0.0, 0.5, 3).tolist())
        scan = Scan(
            ranges_m=ranges, angle_min_rad=pose.yaw, angle_increment_rad=increment,
            range_min_m=0.1, range_max_m=10.0, time_increment_s=time_increment_s,
        )  # fmt: skip
        tracker.update((k + 1) * 10**8, pose, scan)
        assert tracker.beams is not None
        local_map.update(
            (k + 1) * 10**8, pose, tracker.beams, *tracker.moving(), tracker.pose_error
        )
        assert local_map.version >= version
        version = local_map.version
        points = local_map.points()
        assert np.isfinite(points).all()
        assert np.abs(points - pose.position).max(initial=0.0) < 8.0
        found = local_map.distance(*rng.uniform(-5.0, 5.0, (2, 20)))
        assert ((found >= 0.0) & (found <= 0.8)).all()
    assert local_map.occupancy_grid()[1].shape == (160, 160)


def test_the_same_scans_give_the_same_map() -> None:
    maps = []
    for _ in range(2):
        scene = Scene(lambda t: ROOM, scan_m=0.02, odom_m=0.02, odom_rad=0.02)
        for k in range(20):
            scene.step(Pose2D(0.05 * k, 0.0))
        maps.append(scene.map)
    assert maps[0].points().tobytes() == maps[1].points().tobytes()
    assert maps[0].version == maps[1].version


def test_forget_and_an_older_stamp_drop_the_map() -> None:
    scene = Scene(lambda t: ROOM)
    scene.step(Pose2D(0.0, 0.0))
    beams, before = scene.tracker.beams, scene.map.version
    assert beams is not None
    assert scene.map.count > 100
    scene.map.forget()
    assert (scene.map.count, scene.map.version) == (0, before + 1)
    scene.map.update(10**9, Pose2D(1.0, 0.0), beams)
    count, version = scene.map.count, scene.map.version
    scene.map.update(10**9, Pose2D(3.0, 0.0), beams)
    assert (scene.map.count, scene.map.version) == (count, version)
    scene.map.update(9 * 10**8, Pose2D(3.0, 0.0), beams)
    assert scene.map.version == version + 2


def test_the_distance_is_that_to_the_nearest_surface() -> None:
    scene = Scene(lambda t: [(1.5, 0.0, 0.2), *ROOM])
    for _ in range(3):
        scene.step(Pose2D(0.0, 0.0))
    x, y = np.array([1.0, 0.0, 0.0, 100.0]), np.array([0.0, 0.0, -3.5, 0.0])
    found = scene.map.distance(x, y)
    assert found == pytest.approx([0.3, 0.8, 0.45, 0.8], abs=0.02)
    version = scene.map.version
    scene.step(Pose2D(0.0, 0.0))
    assert scene.map.version in (version, version + 1)


def test_the_occupancy_grid_tells_occupied_free_and_unknown() -> None:
    scene = Scene(lambda t: [(1.5, 0.0, 0.2), *ROOM])
    for _ in range(3):
        scene.step(Pose2D(0.0, 0.0))
    (x0, y0), cells = scene.map.occupancy_grid()
    assert cells.dtype == np.int8
    assert cells.shape == (400, 400)

    def at(x: float, y: float) -> int:
        return int(cells[math.floor((y - y0) / 0.05), math.floor((x - x0) / 0.05)])

    assert at(0.5, 0.5) == 0
    assert at(2.5, 0.0) == -1  # behind the disc
    assert at(8.0, 0.0) == -1
    column = cells[:, math.floor((1.3 - x0) / 0.05)]
    assert (column == 100).any()


def test_parameters_are_checked() -> None:
    with pytest.raises(ConfigError, match="cell_m"):
        StaticMapParams(cell_m=0.0)
    with pytest.raises(ConfigError, match="size_m"):
        StaticMapParams(size_m=1e9)
    assert StaticMap().params == StaticMapParams()


@settings(max_examples=60, deadline=None)
@given(st.floats(0.2, 0.5), st.floats(0.35, 1.4), st.floats(-3.1, 3.1))
def test_the_end_of_a_wall_is_no_farther_than_what_may_be_touched(
    away_m: float, angle: float, yaw: float
) -> None:
    """Seen at a grazing angle, its last return is up to a spacing of the beams too early."""
    segments = Segments.of([(0.0, 0.0, 0.0, 2.0)])
    pose = Pose2D(away_m * math.sin(angle), -away_m * math.cos(angle), yaw)
    lidar = Lidar(beams=360, range_max_m=3.5)
    scan = aligned(scan_at(pose, lidar, [], None, segments), yaw)
    tracker, local_map = Tracker(), StaticMap()
    for k in (1, 2):
        tracker.update(k * 100_000_000, pose, scan)
        beams = tracker.beams
        assert beams is not None
        local_map.update(k * 100_000_000, pose, beams, *tracker.moving(), tracker.pose_error)
    lowest_m = float(local_map.contact_points()[:, 1].min())
    present_m = float(local_map.present_points()[:, 1].min())
    assert lowest_m <= present_m
    assert lowest_m <= max(0.002, present_m - 0.029), "it reaches the end, or 3 cm on"
    assert lowest_m >= -0.031


def test_at_the_begin_what_stands_counts_as_soon_as_it_is_known_what_moves() -> None:
    """0.3 s after the first scan instead of 0.8 s, and not while something surely moves."""

    def counts(speed: float) -> list[int]:
        walls = wall((-1.0, 1.5), (2.0, 1.5))
        scene = Scene(lambda t: [*walls, (-1.0 + speed * t, -1.0, 0.25)])
        found = []
        for _ in range(12):
            scene.step(Pose2D(0.0, 0.0))
            found.append(scene.map.established_points().shape[0])
        return found

    still, crossed = counts(0.0), counts(1.0)
    assert still[:3] == crossed[:3] == [0, 0, 0]
    assert all(still[3:])
    assert crossed[3:8] == [0] * 5
    assert all(crossed[9:])


def test_after_a_jump_the_begin_is_the_first_scan_after_it() -> None:
    walls = wall((-1.0, 1.5), (2.0, 1.5))
    scene = Scene(lambda t: walls)
    for _ in range(12):
        scene.step(Pose2D(0.0, 0.0))
    scene.map.forget()
    found = []
    for _ in range(5):
        scene.step(Pose2D(0.0, 0.0))
        found.append(scene.map.established_points().shape[0] > 0)
    assert found == [False, False, False, True, True]
