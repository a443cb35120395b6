# SPDX-License-Identifier: Apache-2.0
"""How hard a world is for a robot that does nothing at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.geometry import distance
from ...simulation.scenario import Scenario
from ...simulation.uniform_segments import UniformSegments, uniform_segments
from .trip import ROOM

_PLACES = 10  # per side of the area


@dataclass(frozen=True, slots=True, kw_only=True)
class Survivability:
    """What befalls a standing robot, over places it could stand at when the run begins."""

    share: float  # of the places that nobody touches during the straight trip's time
    mean_time_s: float  # until the first contact, at the most the trip's time
    places: int


def survivability(scenario: Scenario, speed_mps: float) -> Survivability:
    """Stand at a 10 x 10 raster between start and goal and wait for the first contact.

    The time waited is that of the straight trip at speed_mps. Places inside an obstacle at
    t = 0 are left out; without any other, the share is 0.
    """
    horizon_s = distance(scenario.start_m, scenario.goal_m) / speed_mps
    places = _raster(scenario)
    first = first_contact_s(uniform_segments(scenario, horizon_s), places)
    standing = first > 0.0
    if not standing.any():
        return Survivability(share=0.0, mean_time_s=0.0, places=0)
    waited = np.minimum(first[standing], horizon_s)
    return Survivability(
        share=float(np.mean(first[standing] > horizon_s)),
        mean_time_s=float(np.mean(waited)),
        places=int(standing.sum()),
    )


def _raster(scenario: Scenario) -> np.ndarray:
    """Centres of the cells of the walled area, or of the box of the generated worlds, (n, 2)."""
    area = scenario.walls or ROOM
    cells = (np.arange(_PLACES) + 0.5) / _PLACES
    xs = area.lower_m[0] + cells * (area.upper_m[0] - area.lower_m[0])
    ys = area.lower_m[1] + cells * (area.upper_m[1] - area.lower_m[1])
    return np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)


def first_contact_s(segments: UniformSegments, places: np.ndarray) -> np.ndarray:
    """When an enlarged circle first reaches each place, inf for never; places (n, 2) in m."""
    if not segments.t0.size:
        return np.full(len(places), np.inf)
    px = segments.x - places[:, :1]  # (n, m): centre seen from the place
    py = segments.y - places[:, 1:]
    a = segments.vx**2 + segments.vy**2
    b = px * segments.vx + py * segments.vy
    c = px**2 + py**2 - segments.radius**2
    under = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        entry = (-b - np.sqrt(under)) / a
    reached = (under >= 0.0) & (a > 0.0) & (entry >= 0.0) & (entry <= segments.t1 - segments.t0)
    times = np.where(reached, segments.t0 + entry, np.inf)
    times = np.where(c <= 0.0, segments.t0, times)  # inside as the leg begins
    return times.min(axis=1)
