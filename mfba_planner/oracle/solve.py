# SPDX-License-Identifier: Apache-2.0
"""The oracle itself: straight line, tangents, refinement, proof, lattice, independent check."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import distance
from ..core.legs import Legs, uniform_legs
from ..core.world import Scenario, Walls
from .check import inspect
from .lattice import LatticeParams, lattice_ways
from .polyline import gaps, lengths
from .reach import unreachable
from .refine import refine
from .solution import Certificate, Solution, Waypoint
from .tangents import CLEAR_M, Search, SearchParams


def solve(
    scenario: Scenario,
    speed_mps: float,
    params: SearchParams | None = None,
    *,
    inside: Walls | None = None,
) -> Solution:
    """The shortest collision-free trajectory found at constant speed, with full knowledge.

    The robot may cross walls, as in every run; inside keeps its centre within a rectangle
    (start and goal have to lie in it). Raises ConfigError for a speed that is none.
    """
    if not (math.isfinite(speed_mps) and speed_mps > 0.0):
        raise ConfigError(f"speed_mps={speed_mps}: no speed; give a number above 0")
    task = _Task(scenario, speed_mps, params or SearchParams(), inside)
    reason = ""
    for points in task.ways():
        waypoints = _timed(scenario, points, speed_mps)
        smallest, reason = inspect(scenario, waypoints, speed_mps)
        if not reason:
            return Solution(
                certificate=Certificate.FEASIBLE,
                speed_mps=speed_mps,
                straight_m=task.straight_m,
                waypoints=waypoints,
                clearance_m=smallest,
            )
    return Solution(
        certificate=Certificate.INFEASIBLE if task.proof else Certificate.UNDECIDED,
        speed_mps=speed_mps,
        straight_m=task.straight_m,
        reason=task.proof or reason or "no way found, and no proof that there is none",
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


class _Task:
    """One world for one speed: what has been tried, what was found."""

    def __init__(
        self, scenario: Scenario, speed_mps: float, params: SearchParams, inside: Walls | None
    ) -> None:
        self.scenario, self.v, self.params, self.inside = scenario, speed_mps, params, inside
        self.straight = np.array([scenario.start_m, scenario.goal_m])
        self.straight_m = distance(scenario.start_m, scenario.goal_m)
        self.active: set[int] = set()
        self.proof = ""

    def ways(self) -> Iterator[np.ndarray]:
        """Ways worth a check, the best first; each effort is made when the last one failed."""
        limit_s = self.scenario.time_limit_s
        straight_s = self.straight_m / self.v
        if straight_s > limit_s:
            self.proof = f"the straight way alone takes {straight_s:g} s of {limit_s:g} s"
            return
        horizon_s = min(limit_s, 1.5 * straight_s + 5.0)
        legs = uniform_legs(self.scenario, horizon_s)
        touched = self._touched(self.straight, legs)
        if not touched:
            yield self.straight
            return
        self.active |= touched
        yield from self._refined(self._by_tangents(legs), legs)
        legs = uniform_legs(self.scenario, limit_s)
        self.proof = unreachable(self.scenario, self.v, legs)
        if self.proof:
            return
        if horizon_s < limit_s:
            yield from self._refined(self._by_tangents(legs), legs)
        yield from self._refined(self._by_lattice(legs, 1.25 * straight_s), legs)
        yield from self._refined(self._by_lattice(legs, min(limit_s, 2.5 * straight_s)), legs)

    def _refined(self, ways: list[np.ndarray], legs: Legs) -> Iterator[np.ndarray]:
        tried = (refine(way, self.v, legs, self.inside) for way in ways)
        refined = [points for points in tried if points is not None]
        yield from sorted(refined, key=lambda points: float(lengths(points[None])[0]))
        yield from ways

    def _touched(self, way: np.ndarray, legs: Legs) -> set[int]:
        """Obstacles that a way runs into."""
        gap = gaps(way[None], self.v, legs)[0]
        return set(legs.obstacle[(gap < CLEAR_M / 2.0).any(axis=0)].tolist())

    def _by_tangents(self, legs: Legs) -> list[np.ndarray]:
        """Shortest ways among a few obstacles; whom the best one touches joins them.

        What is shortest among some obstacles and free of all is shortest among all.
        """
        start, goal = self.scenario.start_m, self.scenario.goal_m
        while True:
            some = legs.of(sorted(self.active))
            ways = Search(start, goal, self.v, some, self.params, self.inside).ways()
            if not ways:
                return []
            touched = self._touched(ways[0], legs)
            if not touched - self.active:
                return [way for way in ways if not self._touched(way, legs)]
            self.active |= touched

    def _by_lattice(self, legs: Legs, limit_s: float) -> list[np.ndarray]:
        start, goal = self.scenario.start_m, self.scenario.goal_m
        return lattice_ways(start, goal, self.v, legs, limit_s, LatticeParams(), self.inside)
