# SPDX-License-Identifier: Apache-2.0
"""A map known before: the points of a grid, what is refused, and what the lidar sees through."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from mfba_planner.core.errors import FrameError, InputError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.perception.known_map import (
    MOST_CELLS,
    MOST_POINTS,
    KnownMap,
    UnclearedMap,
    known_map,
)
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.occupancy_grid import OccupancyGrid
from mfba_planner.perception.scan_beams import Beams
from mfba_planner.recording.from_messages import known_map_from
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.scenario_map import CELL_M, scenario_grid
from mfba_planner.simulation.simulated_lidar import scan_at

SECOND_NS = 1_000_000_000
AT_ZERO = Pose2D(0.0, 0.0)


def grid(cells: Any, cell_m: float = 0.05, origin: Pose2D = AT_ZERO) -> OccupancyGrid:
    return OccupancyGrid(0, origin, cell_m, np.array(cells, dtype=np.int8))


def test_the_centres_of_occupied_cells_from_the_origin() -> None:
    cells = np.zeros((4, 6))
    cells[1, 2] = cells[3, 5] = 100
    found = known_map(grid(cells, 0.05, Pose2D(-1.0, 2.0))).points_m
    assert found == pytest.approx(np.array([(-0.875, 2.075), (-0.725, 2.175)]))


@pytest.mark.parametrize(("value", "count"), [(-1, 0), (0, 0), (64, 0), (65, 1), (100, 1)])
def test_occupied_is_from_65_and_unknown_is_free(value: int, count: int) -> None:
    assert known_map(grid([[0, value, -1]])).count == count


def test_only_the_outline_of_what_is_occupied() -> None:
    cells = np.full((7, 9), 100)
    found = known_map(grid(cells, 1.0 / 16.0)).points_m  # a cell is two points wide
    n = 1.0 / 16.0
    on_rim = (found < n).any(axis=1) | (found > np.array([8 * n, 6 * n])).any(axis=1)
    assert on_rim.all()
    cells[3, 4] = -1  # what is unknown inside makes an outline too
    inner = known_map(grid(cells, 1.0 / 16.0)).count - found.shape[0]
    assert inner == 4 * 4


def test_a_coarse_cell_is_closed_all_around() -> None:
    found = known_map(grid([[0, 0, 0], [0, 100, 0], [0, 0, 0]], 0.5)).points_m
    assert found.min(axis=0) == pytest.approx([0.525, 0.525])
    assert found.max(axis=0) == pytest.approx([0.975, 0.975])
    angles = np.sort(np.arctan2(*(found - 0.75).T))
    assert np.diff(angles).max() < math.radians(15.0), "no hole"


def test_a_fine_map_has_one_point_per_5_cm() -> None:
    cells = np.zeros((10, 1000))
    cells[5] = 100
    found = known_map(grid(cells, 0.01)).points_m
    assert found.shape[0] == pytest.approx(200, abs=2)
    assert np.diff(np.sort(found[:, 0])).max() < 0.1


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (grid([[100]], 0.0), "resolution=0 m: not from 0.001 to 10 m; save it"),
        (grid([[100]], math.nan), "resolution=nan m"),
        (grid([[100]], 20.0), "resolution=20 m"),
        (grid(np.zeros((0, 5))), "5 x 0 cells: not from 1 to"),
        (grid([[100]], 0.05, Pose2D(0.0, 0.0, 0.1)), "rotated by 0.1 rad, which is not supported"),
        (grid([[100]], 0.05, Pose2D(1e9, 0.0)), "origin at"),
    ],
)
def test_a_grid_that_cannot_be_used_is_refused_with_the_remedy(
    made: OccupancyGrid, text: str
) -> None:
    with pytest.raises(InputError, match=text):
        known_map(made)


def test_the_number_of_points_is_bounded() -> None:
    side = math.isqrt(2 * MOST_POINTS) + 2
    specks = np.indices((side, side)).sum(axis=0) % 2 * 100
    with pytest.raises(InputError, match="more than 500000 points on the outline"):
        known_map(grid(specks))
    with pytest.raises(InputError, match="more than 500000 points"):
        known_map(grid(np.eye(700) * 100, 10.0))


def test_more_cells_than_a_scenario_may_have_are_refused_before_they_are_read() -> None:
    message = Message()
    message.info.width, message.info.height = MOST_CELLS, 2
    with pytest.raises(InputError, match=f"{MOST_CELLS} x 2 cells: not from 1 to {MOST_CELLS}"):
        known_map_from(message)


@dataclass
class Namespace:
    """Any part of a message."""

    frame_id: str = "odom"
    sec: int = 0
    nanosec: int = 0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass
class Origin:
    position: Namespace = field(default_factory=Namespace)
    orientation: Namespace = field(default_factory=Namespace)


@dataclass
class Info:
    resolution: float = 0.05
    width: int = 2
    height: int = 1
    origin: Origin = field(default_factory=Origin)


@dataclass
class Header:
    frame_id: str = "odom"
    stamp: Namespace = field(default_factory=Namespace)


@dataclass
class Message:
    """As nav_msgs/OccupancyGrid."""

    header: Header = field(default_factory=Header)
    info: Info = field(default_factory=Info)
    data: list[int] = field(default_factory=lambda: [0, 100])


def test_a_message_is_read() -> None:
    message = Message()
    message.info.origin.position.x = 1.0
    assert known_map_from(message, "odom").points_m == pytest.approx(np.array([(1.075, 0.025)]))


def test_a_message_in_another_frame_is_refused_with_the_remedy() -> None:
    message = Message(header=Header(frame_id="map"))
    with pytest.raises(FrameError, match="map is in frame 'map', not 'odom', and no tf is read"):
        known_map_from(message, "odom")
    assert known_map_from(message).count == 1, "any frame"


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_message_that_is_not_finite_is_refused(bad: float) -> None:
    for change in ("resolution", "origin"):
        message = Message()
        if change == "origin":
            message.info.origin.position.y = bad
        else:
            message.info.resolution = bad
        with pytest.raises(InputError, match=change):
            known_map_from(message)


def test_a_message_with_too_few_cells_is_refused() -> None:
    with pytest.raises(InputError, match="holds 1 cells, but width=2 and height=1 make 2"):
        known_map_from(Message(data=[100]))


def test_near_gives_the_points_between_two_corners() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-5.0, 5.0, (500, 2))
    known = KnownMap(points)
    low, high = (-1.0, -2.0), (3.0, 0.5)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    found = known.points_m[known.near(low, high)]
    assert sorted(map(tuple, found.tolist())) == sorted(map(tuple, points[inside].tolist()))
    assert known == KnownMap(points[::-1])
    assert known != KnownMap(points[1:])


def test_along_a_line_no_near_point_is_left_out() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform(-20.0, 20.0, (3000, 2))
    start, end, room_m = np.array([-15.0, 4.0]), np.array([17.0, -9.0]), 0.5
    share = ((points - start) @ (end - start) / ((end - start) @ (end - start))).clip(0.0, 1.0)
    away = np.linalg.norm(points - start - share[:, None] * (end - start), axis=1)
    found = UnclearedMap(KnownMap(points), 0.12).along(
        tuple(start.tolist()), tuple(end.tolist()), room_m
    )
    wanted = {tuple(p) for p in points[away < room_m].tolist()}
    assert wanted <= {tuple(p) for p in found.tolist()}
    assert len(found) < 1000


def beams(discs: list[tuple[float, float, float]], tracker: Tracker, k: int) -> Beams:
    """Of the k-th scan from (0, 0)."""
    scan = scan_at(Pose2D(0.0, 0.0), Lidar(beams=360, range_max_m=10.0), discs, None)
    tracker.update(k * SECOND_NS // 10, Pose2D(0.0, 0.0), scan)
    assert tracker.beams is not None
    return tracker.beams


def test_what_two_scans_see_through_is_dropped_and_what_they_meet_is_kept() -> None:
    wall = [(3.0, y, 0.05) for y in np.arange(-2.0, 2.01, 0.05).tolist()]
    points = [(3.03, 0.0), (2.0, 0.5), (2.95, 1.0), (4.0, 0.0), (9.5, 3.0), (0.0, -3.0)]
    known = UnclearedMap(KnownMap(np.array(points)), 0.12)
    tracker = Tracker()
    all_ = (-20.0, -20.0), (20.0, 20.0)
    known.update(beams(wall, tracker, 1), (0.0, 0.0), 0.0)
    assert len(known.near(*all_)) == 6
    assert known.version == 0
    known.update(beams(wall, tracker, 2), (0.0, 0.0), 0.0)
    kept = sorted(map(tuple, known.near(*all_).tolist()))
    # Kept: on the wall, less than 0.3 m before it, behind it, where beams are far apart.
    assert kept == [(2.95, 1.0), (3.03, 0.0), (4.0, 0.0), (9.5, 3.0)]
    assert known.version == 1


def test_one_scan_that_meets_a_point_in_between_keeps_it() -> None:
    known = UnclearedMap(KnownMap(np.array([(2.0, 0.0)])), 0.12)
    tracker = Tracker()
    for k, radius in enumerate((0.0, 0.3, 0.0, 0.3), start=1):
        discs = [(2.0, 0.0, radius)] if radius else []
        known.update(beams(discs, tracker, k), (0.0, 0.0), 0.0)
    assert len(known.near((0.0, -1.0), (5.0, 1.0))) == 1


def test_the_turn_to_the_maps_frame_counts() -> None:
    """Beams in odom, which is turned by 90 degrees against the map."""
    wall = [(3.0, y, 0.05) for y in np.arange(-2.0, 2.01, 0.05).tolist()]
    known = UnclearedMap(KnownMap(np.array([(0.0, 3.0), (3.0, 0.0)])), 0.12)
    tracker = Tracker()
    for k in (1, 2):
        known.update(beams(wall, tracker, k), (0.0, 0.0), math.radians(90.0))
    assert known.near((-5.0, -5.0), (5.0, 5.0)).tolist() == [[0.0, 3.0]]


def test_a_scenarios_grid_has_a_point_all_along_each_wall() -> None:
    walls = ((1.0, 1.0, 5.0, 3.0), (2.0, -1.0, 2.0, 4.0), (-3.0, 0.5, 1.0, 0.5))
    made = scenario_grid(
        Scenario(name="s", start_m=(0.0, -3.0), goal_m=(9.0, 0.0), segments_m=walls)
    )
    assert float(np.float32(made.cell_m)) == made.cell_m, "as the message carries it"
    points = known_map(made).points_m
    for x0, y0, x1, y1 in walls:
        at = np.linspace((x0, y0), (x1, y1), 200)
        away = np.sqrt(((at[:, None] - points) ** 2).sum(axis=2))
        assert away.min(axis=1).max() < 0.71 * CELL_M
    start, wall = np.array(walls)[:, :2], np.array(walls)[:, 2:] - np.array(walls)[:, :2]
    share = ((points[:, None] - start) * wall).sum(axis=2) / (wall * wall).sum(axis=1)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * wall
    off = np.sqrt(((points[:, None] - nearest) ** 2).sum(axis=2)).min(axis=1)
    assert off.max() < 0.71 * CELL_M, "and nowhere else"


def test_a_scenario_without_walls_has_a_map_without_points() -> None:
    made = scenario_grid(Scenario(name="s", start_m=(2.0, 3.0), goal_m=(9.0, 0.0)))
    assert known_map(made).count == 0
