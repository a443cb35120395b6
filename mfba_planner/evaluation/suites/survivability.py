# SPDX-License-Identifier: Apache-2.0
"""Survivability: how long a robot that stands still is not hit, a measure of difficulty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.geometry import distance
from ...simulation.constant_velocity_segments import UniformSegments, uniform_segments
from ...simulation.obstacle_motion import Walls
from ...simulation.scenario import Scenario
from .task_geometry import ROOM

_CELLS = 10  # raster cells per side of the area


@dataclass(frozen=True, slots=True, kw_only=True)
class Survivability:
    """Contacts of a standing robot, over raster positions that are free at t = 0."""

    share: float  # of positions that no obstacle touches during the time of the straight trip
    mean_time_s: float  # until the first contact, at most the time of the trip
    positions: int


def area_of(scenario: Scenario) -> Walls:
    """The box of start and goal; a side shorter than half the longer one is widened to that."""
    ends = list(zip(scenario.start_m, scenario.goal_m))
    half = 0.25 * max(abs(a - b) for a, b in ends)
    corners = [(min(a, b, 0.5 * (a + b) - half), max(a, b, 0.5 * (a + b) + half)) for a, b in ends]
    return Walls(lower_m=(corners[0][0], corners[1][0]), upper_m=(corners[0][1], corners[1][1]))


def survivability(scenario: Scenario, speed_mps: float, area: Walls = ROOM) -> Survivability:
    """Survivability over a 10 x 10 raster of positions, for the time of the straight trip.

    The raster covers the scenario's walls, without them the area. The trip is driven at
    speed_mps. Positions inside an obstacle at t = 0 are left out; without
    any other, the share is 0.
    """
    horizon_s = distance(scenario.start_m, scenario.goal_m) / speed_mps
    positions = _raster(scenario.walls or area)
    first = first_contact_s(uniform_segments(scenario, horizon_s), positions)
    free = first > 0.0
    if not free.any():
        return Survivability(share=0.0, mean_time_s=0.0, positions=0)
    waited = np.minimum(first[free], horizon_s)
    return Survivability(
        share=float(np.mean(first[free] > horizon_s)),
        mean_time_s=float(np.mean(waited)),
        positions=int(free.sum()),
    )


def _raster(area: Walls) -> np.ndarray:
    """Centres of the cells of the area, (n, 2)."""
    cells = (np.arange(_CELLS) + 0.5) / _CELLS
    xs = area.lower_m[0] + cells * (area.upper_m[0] - area.lower_m[0])
    ys = area.lower_m[1] + cells * (area.upper_m[1] - area.lower_m[1])
    return np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)


def first_contact_s(segments: UniformSegments, positions: np.ndarray) -> np.ndarray:
    """Time at which an enlarged circle first reaches each position (n, 2), inf for never; (n,)."""
    if not segments.t0.size:
        return np.full(len(positions), np.inf)
    px = segments.x - positions[:, :1]  # (n, m): centre relative to the position
    py = segments.y - positions[:, 1:]
    a = segments.vx**2 + segments.vy**2
    b = px * segments.vx + py * segments.vy
    c = px**2 + py**2 - segments.radius**2
    under = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        entry = (-b - np.sqrt(under)) / a
    reached = (under >= 0.0) & (a > 0.0) & (entry >= 0.0) & (entry <= segments.t1 - segments.t0)
    times = np.where(reached, segments.t0 + entry, np.inf)
    times = np.where(c <= 0.0, segments.t0, times)  # inside at the start of the segment
    return times.min(axis=1)
