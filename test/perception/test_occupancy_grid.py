# SPDX-License-Identifier: Apache-2.0
"""The local map as an occupancy grid: cut to what is known, and placed in odom."""

import math

import numpy as np
import pytest
from mapped_scenes import Scene, room

from mfba_planner.core.geometry import Pose2D
from mfba_planner.perception.occupancy_grid import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyGrid,
    cut_to_known,
)
from mfba_planner.perception.static_map import StaticMap


def test_only_known_cells_are_kept() -> None:
    cells = np.full((6, 8), UNKNOWN, dtype=np.int8)
    cells[2, 3], cells[4, 5] = FREE, OCCUPIED
    origin, part = cut_to_known((-1.0, 2.0), cells, 0.5)
    assert origin == (-1.0 + 3 * 0.5, 2.0 + 2 * 0.5)
    assert part.tolist() == [[FREE, -1, -1], [-1, -1, -1], [-1, -1, OCCUPIED]]


def test_where_nothing_is_known_one_cell_is_kept() -> None:
    origin, part = cut_to_known((0.0, 0.0), np.full((4, 6), UNKNOWN, dtype=np.int8), 0.5)
    assert (origin, part.tolist()) == ((1.5, 1.0), [[UNKNOWN]])


def test_occupied_cells_turn_with_the_origin() -> None:
    cells = np.array([[FREE, OCCUPIED], [UNKNOWN, FREE]], dtype=np.int8)
    grid = OccupancyGrid(7, Pose2D(1.0, 2.0, math.pi / 2.0), 0.2, cells)
    (point,) = grid.occupied().tolist()
    assert point == pytest.approx((1.0 - 0.1, 2.0 + 0.3))


def test_a_map_has_no_grid_before_its_first_scan_or_after_it_is_dropped() -> None:
    scene = Scene(lambda _: room(3.0))
    assert StaticMap().known_grid() is None
    scene.step(Pose2D(0.0, 0.0))
    assert scene.map.known_grid() is not None
    scene.map.forget()
    assert scene.map.known_grid() is None


@pytest.mark.parametrize("odom_rad", [0.0, 0.02])
def test_each_point_lies_in_an_occupied_cell_of_odom(odom_rad: float) -> None:
    """The map's frame is turned against odom by the error of the last pose."""
    scene = Scene(lambda _: room(3.0), odom_m=odom_rad, odom_rad=odom_rad, seed=2)
    for k in range(30):
        scene.step(Pose2D(0.02 * k, 0.01 * k, 0.0))
    grid = scene.map.known_grid()
    assert grid is not None
    assert (abs(grid.origin.yaw) > 1e-3) == (odom_rad > 0.0)
    points, centers = scene.map.points(), grid.occupied()
    away = np.sqrt(((points[:, None] - centers[None]) ** 2).sum(axis=2)).min(axis=1)
    assert len(points) > 200
    assert away.max() <= 0.5 * math.sqrt(2.0) * grid.cell_m + 1e-9
    height, width = grid.cells.shape
    assert 5.9 / 0.05 < height < 8.0 / 0.05
    assert 5.9 / 0.05 < width < 8.0 / 0.05
