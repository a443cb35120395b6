# SPDX-License-Identifier: Apache-2.0
"""Worlds in the manner of BARN: cylinders where a cellular automaton left filled cells.

Perille et al., Benchmarking Metric Ground Navigation, SSRR 2020: a grid of 30 x 30 cells of
0.15 m is filled at random to a percentage, then smoothed several times; worlds without a way for
the robot are drawn again. The grid lies in a lane between two rows of cylinders, 30 x 66 cells in
all, closed behind the robot, which drives 10 m along it. These here are drawn anew by that
description: no world is copied.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ...core.geometry import Point
from ...simulation.obstacle_motion import Obstacle
from ...simulation.scenario import Scenario

CELL_M = 0.15
RADIUS_M = 0.075  # of a cylinder
ROBOT_RADIUS_M = 0.22  # of BARN's Jackal, as a disc
COLUMNS, ROWS = 30, 66  # of the lane
FIRST_ROW, FIELD_ROWS = 34, 30  # of the automaton's grid within the lane
FILLED = (0.15, 0.2, 0.25, 0.3)
SMOOTHINGS = (2, 3, 4)
VARIANTS = tuple(product(FILLED, SMOOTHINGS))
FILL_FROM, CLEAR_TO = 5, 1  # filled neighbours of eight from which, and to which, a cell changes
START_M: Point = (2.25, 3.0)
GOAL_M: Point = (2.25, 13.0)

_FINE = 3  # nodes per cell, 0.05 m apart, when a way is searched
_REACH = (
    7  # nodes, 0.35 m: both radii, 0.05 m of spare, and what a step passes nearer than its ends
)


def barn_scenario(name: str, k: int, rng: np.random.Generator) -> Scenario:
    """A world of variant k % 12."""
    filled, smoothings = VARIANTS[k % len(VARIANTS)]
    while not has_path(lane := lane_cells(field_cells(filled, smoothings, rng))):
        pass
    return Scenario(
        name=name,
        start_m=START_M,
        goal_m=GOAL_M,
        robot_radius_m=ROBOT_RADIUS_M,
        obstacles=tuple(
            Obstacle(center_m=_middle(column, row), radius_m=RADIUS_M)
            for row, column in np.argwhere(lane).tolist()
        ),
    )


def field_cells(filled: float, smoothings: int, rng: np.random.Generator) -> np.ndarray:
    """Filled cells (30, 30) of the automaton, rows first; its outer columns stay filled.

    In every smoothing a cell with at least FILL_FROM filled neighbours is filled, one with at
    most CLEAR_TO is cleared, and all others stay.
    """
    cells = rng.random((FIELD_ROWS, COLUMNS)) < filled
    cells[:, [0, -1]] = True
    for _ in range(smoothings):
        padded = np.pad(cells, 1).astype(np.int8)
        around = sum(
            padded[1 + i : 1 + i + FIELD_ROWS, 1 + j : 1 + j + COLUMNS]
            for i, j in product((-1, 0, 1), repeat=2)
            if (i, j) != (0, 0)
        )
        cells = (around >= FILL_FROM) | (cells & (around > CLEAR_TO))
        cells[:, [0, -1]] = True
    return cells


def lane_cells(field: np.ndarray) -> np.ndarray:
    """Filled cells (66, 30) of the whole lane: both sides, the row behind the robot, the field."""
    lane = np.zeros((ROWS, COLUMNS), dtype=bool)
    lane[:, [0, -1]] = lane[0] = True
    lane[FIRST_ROW : FIRST_ROW + FIELD_ROWS] |= field
    return lane


def has_path(lane: np.ndarray) -> bool:
    """Whether the robot, with 0.05 m of spare on either side, gets from start to the far end.

    It goes from node to node, along the axes; all is counted in whole nodes.
    """
    from scipy.ndimage import label

    blocked = np.zeros((ROWS * _FINE, COLUMNS * _FINE), dtype=bool)
    middles = np.argwhere(lane) * _FINE + _FINE // 2
    for i, j in product(range(-_REACH, _REACH + 1), repeat=2):
        if i * i + j * j < _REACH * _REACH:
            near = middles + (i, j)
            near = near[(near >= 0).all(axis=1) & (near < blocked.shape).all(axis=1)]
            blocked[near[:, 0], near[:, 1]] = True
    parts, _ = label(~blocked)
    start = parts[int(START_M[1] / CELL_M) * _FINE + 1, int(START_M[0] / CELL_M) * _FINE + 1]
    return bool(start and (parts[-1] == start).any())


def _middle(column: int, row: int) -> Point:
    return (round((column + 0.5) * CELL_M, 3), round((row + 0.5) * CELL_M, 3))
