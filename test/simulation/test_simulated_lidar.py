# SPDX-License-Identifier: Apache-2.0
"""The lidar's angle of view: which directions it covers; a full circle stays as it was."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D, ray_circle_distance
from mfba_planner.perception.scan_to_sectors import aligned
from mfba_planner.recording.perceived import returns_of
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.obstacle_motion import Walls
from mfba_planner.simulation.robot_model import FULL_CIRCLE_RAD, Lidar
from mfba_planner.simulation.simulated_lidar import cast_rays, rays, scan_at

FRONT = math.radians(270.0)
WALLS = Walls(lower_m=(-2.0, -1.0), upper_m=(3.0, 4.0))


def test_without_the_option_all_is_as_before() -> None:
    """A full circle: the first beam in the middle of the first share, from the x axis on."""
    lidar = Lidar(beams=360)
    scan = scan_at(Pose2D(0.0, 0.0, 0.3), lidar, [(1.0, 0.5, 0.2)], None)
    angles = (np.arange(360) + 0.5) * (2.0 * math.pi / 360)
    assert lidar.first_beam_rad == 0.5 * (2.0 * math.pi / 360)
    assert scan.angle_min_rad == float(np.float32(0.5 * (2.0 * math.pi / 360)))
    assert scan.angle_increment_rad == float(np.float32(2.0 * math.pi / 360))
    c, s = rays(360)
    assert c.tobytes() == np.cos(angles).tobytes()
    assert s.tobytes() == np.sin(angles).tobytes()


@given(
    fov_rad=st.floats(0.2, 6.2),
    beams=st.integers(12, 400),
    yaw_rad=st.floats(-3.0, 3.0),
    turned_rad=st.floats(-3.0, 3.0),
)
def test_a_beam_has_the_range_in_the_direction_that_the_scan_gives_it(
    fov_rad: float, beams: int, yaw_rad: float, turned_rad: float
) -> None:
    """Against the wall's distance by hand, from the message's own angles."""
    lidar = Lidar(
        beams=beams, fov_rad=fov_rad, yaw_rad=turned_rad, range_max_m=20.0, walls=True,
        range_min_m=0.0,
    )  # fmt: skip
    scan = scan_at(Pose2D(0.0, 0.0, yaw_rad), lidar, [], WALLS)
    own = scan.angle_min_rad + scan.angle_increment_rad * np.arange(beams)
    assert np.abs(own).max() <= 0.5 * fov_rad + 1e-5
    assert own[0] == pytest.approx(-own[-1], abs=1e-4), "the same to both sides"
    for angle, found in zip(own + yaw_rad + turned_rad, scan.ranges_m):
        c, s = math.cos(angle), math.sin(angle)
        x = (3.0 if c > 0.0 else -2.0) / c if abs(c) > 1e-9 else math.inf
        y = (4.0 if s > 0.0 else -1.0) / s if abs(s) > 1e-9 else math.inf
        assert found == pytest.approx(min(x, y), rel=1e-3)


@given(
    x_m=st.floats(-0.9, 0.9),
    y_m=st.floats(-0.9, 0.9),
    yaw_rad=st.floats(-3.0, 3.0),
    turned_rad=st.floats(-3.0, 3.0),
    fov_rad=st.sampled_from([FULL_CIRCLE_RAD, 4.0]),
    flipped=st.booleans(),
)
def test_the_returns_of_a_lidar_anywhere_on_the_robot_lie_on_the_walls(
    x_m: float, y_m: float, yaw_rad: float, turned_rad: float, fov_rad: float, flipped: bool
) -> None:
    lidar = Lidar(
        beams=90, fov_rad=fov_rad, x_m=x_m, y_m=y_m, yaw_rad=turned_rad, flipped=flipped,
        range_max_m=20.0, walls=True, range_min_m=0.0,
    )  # fmt: skip
    pose = Pose2D(0.3, 1.2, yaw_rad)
    scan = aligned(scan_at(pose, lidar, [], WALLS), pose.yaw, lidar.extrinsics)
    points = returns_of(scan, pose)
    assert len(points) == 90
    to_walls = np.abs(points[:, [0, 0, 1, 1]] - [3.0, -2.0, 4.0, -1.0]).min(axis=1)
    assert to_walls.max() < 1e-3


def test_what_is_behind_is_not_in_the_scan() -> None:
    lidar = Lidar(beams=360, fov_rad=FRONT)
    behind, ahead = (-1.0, 0.0, 0.2), (1.0, 0.0, 0.2)
    assert not np.isfinite(scan_at(Pose2D(0.0, 0.0), lidar, [behind], None).ranges_m).any()
    assert np.isfinite(scan_at(Pose2D(0.0, 0.0), lidar, [ahead], None).ranges_m).any()
    turned = replace(lidar, yaw_rad=math.pi)
    assert np.isfinite(scan_at(Pose2D(0.0, 0.0), turned, [behind], None).ranges_m).any()


def test_it_is_an_option_of_scenario_files() -> None:
    text = (
        "{name: x, start_m: [0, 0], goal_m: [1, 1], robot: {lidar: {beams: 270, fov_rad: 4.7124}}}"
    )
    lidar = load_scenario(text).robot.lidar
    assert (lidar.beams, lidar.fov_rad) == (270, 4.7124)
    with pytest.raises(ConfigError, match=r"fov_rad=7"):
        Lidar(fov_rad=7.0)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.05, 0.9), st.floats(-3.0, 3.0))
def test_ranges_to_one_circle_from_outside_on_it_and_inside(
    x: float, y: float, r: float, turned_rad: float
) -> None:
    """Against the general formula for a ray and a circle; inside it every range is 0."""
    found = cast_rays((0.25, -0.5), [(x, y, r)], 24, 5.0, turned_rad)
    away, bearing = math.hypot(x - 0.25, y + 0.5), math.atan2(y + 0.5, x - 0.25)
    for k, value in enumerate(found.tolist()):
        off = turned_rad + (k + 0.5) * math.pi / 12.0 - bearing
        if abs(abs(away * math.sin(off)) - r) > 1e-9 and abs(away - r) > 1e-9:
            expected = ray_circle_distance(away, r, off)
            assert value == pytest.approx(expected, abs=1e-7)
