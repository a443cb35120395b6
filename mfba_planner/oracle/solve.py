# SPDX-License-Identifier: Apache-2.0
"""The oracle itself: straight line, tangent search, refinement, independent check."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import distance
from ..core.legs import Legs, uniform_legs
from ..core.world import Scenario
from .check import inspect
from .polyline import gaps, lengths
from .refine import refine
from .solution import Certificate, Solution, Waypoint
from .tangents import CLEAR_M, Search, SearchParams


def solve(
    scenario: Scenario, speed_mps: float, params: SearchParams | None = None
) -> Solution:
    """The shortest collision-free trajectory found at constant speed, with full knowledge.

    The robot may cross walls, as in every run. Raises ConfigError for a speed that is none.
    """
    if not (math.isfinite(speed_mps) and speed_mps > 0.0):
        raise ConfigError(f"speed_mps={speed_mps}: no speed; give a number above 0")
    straight_m = distance(scenario.start_m, scenario.goal_m)
    reason = "no way found"
    for points in _ways(scenario, speed_mps, params or SearchParams()):
        waypoints = _timed(scenario, points, speed_mps)
        smallest, reason = inspect(scenario, waypoints, speed_mps)
        if not reason:
            return Solution(
                certificate=Certificate.FEASIBLE,
                speed_mps=speed_mps,
                straight_m=straight_m,
                waypoints=waypoints,
                clearance_m=smallest,
            )
    return Solution(
        certificate=Certificate.UNDECIDED,
        speed_mps=speed_mps,
        straight_m=straight_m,
        reason=reason,
    )


def _timed(scenario: Scenario, points: np.ndarray, speed_mps: float) -> tuple[Waypoint, ...]:
    """Waypoints along a polyline from t = 0 on; the ends are the scenario's own."""
    places = [scenario.start_m, *map(tuple, points[1:-1].tolist()), scenario.goal_m]
    waypoints = [Waypoint(0.0, *scenario.start_m)]
    travelled = 0.0
    for before, (x, y) in zip(places, places[1:]):
        travelled += math.dist(before, (x, y))
        waypoints.append(Waypoint(travelled / speed_mps, x, y))
    return tuple(waypoints)


def _ways(scenario: Scenario, speed_mps: float, params: SearchParams) -> Iterator[np.ndarray]:
    """Ways worth a check, the best first."""
    straight = np.array([scenario.start_m, scenario.goal_m])
    straight_s = float(lengths(straight[None])[0]) / speed_mps
    horizon_s = 1.5 * straight_s + 5.0
    active: set[int] = set()
    while True:
        horizon_s = min(horizon_s, scenario.time_limit_s)
        legs = uniform_legs(scenario, horizon_s)
        touched = _touched(straight, speed_mps, legs)
        if not touched:
            yield straight
        active |= touched
        found = _search(scenario, speed_mps, legs, active, params)
        if found or horizon_s >= scenario.time_limit_s:
            break
        horizon_s *= 2.0
    refined = [
        points for way in found if (points := refine(way, speed_mps, legs)) is not None
    ]
    yield from sorted(refined, key=lambda points: float(lengths(points[None])[0]))
    yield from found


def _touched(way: np.ndarray, speed_mps: float, legs: Legs) -> set[int]:
    """Obstacles that a way runs into."""
    gap = gaps(way[None], speed_mps, legs)[0]
    return set(legs.obstacle[(gap < CLEAR_M / 2.0).any(axis=0)].tolist())


def _search(
    scenario: Scenario, speed_mps: float, legs: Legs, active: set[int], params: SearchParams
) -> list[np.ndarray]:
    """Shortest ways among a few obstacles; those the best runs into join them, until none does.

    What is shortest among some obstacles and free of all is shortest among all.
    """
    while True:
        some = legs.of(sorted(active))
        ways = Search(scenario.start_m, scenario.goal_m, speed_mps, some, params).ways()
        if not ways:
            return []
        touched = _touched(ways[0], speed_mps, legs)
        if not touched - active:
            return [way for way in ways if not _touched(way, speed_mps, legs)]
        active |= touched
