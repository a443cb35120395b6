# SPDX-License-Identifier: Apache-2.0
"""Whether a robot gets through a place: flood fill of a grid, without the package's own search."""

import math

import numpy as np
from scipy.ndimage import label

from mfba_planner.core.geometry import Point
from mfba_planner.simulation.scenario import Scenario


def clearance_at(world: Scenario, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distance (m) of points to the nearest wall or obstacle at rest; inf without any."""
    found = np.full(np.broadcast(x, y).shape, np.inf)
    for x0, y0, x1, y1 in world.segments_m:
        dx, dy = x1 - x0, y1 - y0
        s = np.clip(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        found = np.minimum(found, np.hypot(x - x0 - s * dx, y - y0 - s * dy))
    for obstacle in world.obstacles:
        if obstacle.top_speed_mps == 0.0:
            cx, cy = obstacle.center_m
            found = np.minimum(found, np.hypot(x - cx, y - cy) - obstacle.radius_m)
    return found


def clearance_of(world: Scenario, point: Point) -> float:
    """clearance_at() one point."""
    return float(clearance_at(world, np.array(point[0]), np.array(point[1])))


def has_path(world: Scenario, radius_m: float, cell_m: float = 0.02) -> bool:
    """Whether a disc of this radius, at least, gets from start to goal within the scene's box.

    A way of that width, straight or bent, may be lost by up to a cell: ask for that much less.
    """
    xs = [v for s in world.segments_m for v in s[::2]] + [o.center_m[0] for o in world.obstacles]
    ys = [v for s in world.segments_m for v in s[1::2]] + [o.center_m[1] for o in world.obstacles]
    ends = world.start_m, world.goal_m
    low = [min(v + [p[i] for p in ends]) - 1.0 for i, v in enumerate((xs, ys))]
    high = [max(v + [p[i] for p in ends]) + 1.0 for i, v in enumerate((xs, ys))]
    columns, rows = (np.arange(a, b, cell_m) for a, b in zip(low, high))
    free = clearance_at(world, columns[None, :], rows[:, None]) >= radius_m
    parts, _ = label(free)
    start, goal = (
        parts[math.floor((y - low[1]) / cell_m + 0.5), math.floor((x - low[0]) / cell_m + 0.5)]
        for x, y in ends
    )
    return bool(start) and bool(start == goal)
