# SPDX-License-Identifier: Apache-2.0
"""A scenario's walls as a map known before the drive, the same for every driver."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import Pose2D
from ..core.planner_types import PathPlanner
from ..perception.known_map import MOST_CELLS, known_map
from ..perception.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from ..planning.planner_params import PlannerParams
from ..planning.supervised_planner import TakesKnownMap
from .scenario import Scenario

CELL_M = float(np.float32(0.05))  # as nav_msgs/OccupancyGrid carries it
_PER_CELL = 4  # points of a segment per cell
_MOST_SAMPLES = 20_000_000

P = TypeVar("P", bound=PathPlanner)


def scenario_grid(scenario: Scenario) -> OccupancyGrid:
    """The cells that a wall segment passes, in odom; without walls one free cell at the start.

    Raises ConfigError for a place that is too large.
    """
    walls = np.array(scenario.segments_m or [scenario.start_m * 2]).reshape(-1, 2, 2)
    low = np.floor(walls.min(axis=(0, 1)) / CELL_M).astype(np.int64) - 1
    high = np.floor(walls.max(axis=(0, 1)) / CELL_M).astype(np.int64) + 2
    (width, height), wide = (high - low).tolist(), walls[:, 1] - walls[:, 0]
    length = np.sqrt((wide * wide).sum(axis=1))
    count = np.ceil(length / (CELL_M / _PER_CELL)).astype(np.int64) + 1
    if width * height > MOST_CELLS or int(count.sum()) > _MOST_SAMPLES:
        raise ConfigError(
            f"the walls of scenario {scenario.name!r} make a map of {width} x {height} cells of "
            f"{CELL_M:.2f} m, more than {MOST_CELLS}; leave known_map and publish_map out"
        )
    cells = np.full((height, width), FREE, dtype=np.int8)
    if scenario.segments_m:
        number = np.repeat(np.arange(count.size), count)
        k = np.arange(number.size) - np.repeat(np.cumsum(count) - count, count)
        share = k / np.maximum(count - 1, 1)[number]
        at = walls[number, 0] + share[:, None] * wide[number]
        i, j = (np.floor(at / CELL_M).astype(np.int64) - low).T
        cells[j, i] = OCCUPIED
    origin = Pose2D(float(low[0]) * CELL_M, float(low[1]) * CELL_M, 0.0)
    return OccupancyGrid(0, origin, CELL_M, cells)


def with_known_map(path_planner: P, params: PlannerParams, scenario: Scenario) -> P:
    """The planner, with the scenario's walls as its map if params.known_map says so."""
    takes: object = path_planner
    if params.known_map and isinstance(takes, TakesKnownMap):
        takes.set_known_map(known_map(scenario_grid(scenario)))
    return path_planner
