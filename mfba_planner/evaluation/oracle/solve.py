# SPDX-License-Identifier: Apache-2.0
"""Solve a world: straight line, tangent search, refinement, infeasibility proof, lattice."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...core.errors import ConfigError
from ...core.geometry import distance
from ...simulation.constant_velocity_segments import UniformSegments, uniform_segments
from ...simulation.obstacle_motion import Walls
from ...simulation.scenario import Scenario
from ...simulation.triggers import with_triggers
from .distance_to_go import DistanceToGo
from .footprint_discs import disc_around, disc_within
from .infeasibility_proof import unreachable
from .lattice_search import LatticeParams, lattice_paths
from .path_check import inspect
from .path_refinement import refine
from .polyline import gaps, lengths, within
from .solution import Certificate, Solution, Waypoint
from .static_walls import StaticWalls, WallEnds
from .tangent_search import CLEAR_M, Search, SearchParams

_LONG, _VERY_LONG = 1.05, 1.08  # times the straight line
_MOST_ACTIVE, _MOST_ACTIVE_UNKNOWN = 150, 400  # the time grows with the square of their number
_FINE = LatticeParams(step_s=0.6, headings=48, cell_m=0.1)
_COARSE = LatticeParams()


def solve(
    scenario: Scenario,
    speed_mps: float,
    params: SearchParams | None = None,
    *,
    inside: Walls | None = None,
) -> Solution:
    """The shortest collision-free trajectory found at constant speed, with full knowledge.

    The robot may cross Scenario.walls, as in every run, but no wall segment; inside keeps its
    centre within a rectangle (start and goal have to lie in it). Undecided where an obstacle
    waits for a trigger. For a robot with a footprint it is the trajectory of the disc of
    robot_radius_m around it, and infeasible means so for a disc within it. Raises ConfigError for
    a speed that is not above 0.
    """
    if not (math.isfinite(speed_mps) and speed_mps > 0.0):
        raise ConfigError(f"speed_mps={speed_mps}: no speed; give a number above 0")
    if numbers := with_triggers(scenario):
        reason = f"obstacle {numbers[0]} waits for a trigger: its motion depends on the path"
        return _undecided(scenario, speed_mps, reason)
    of_proof: Scenario | None = scenario
    reason = "no path found, and no proof that there is none"
    if scenario.robot.footprint_m:
        of_proof, reason = disc_within(scenario), _about_discs(scenario)
        try:
            scenario = disc_around(scenario)
        except ConfigError as error:
            return _undecided(scenario, speed_mps, f"for the disc around the footprint, {error}")
    task = _Task(scenario, speed_mps, params or SearchParams(), inside, of_proof)
    for points in task.paths():
        waypoints = _timed(scenario, points, speed_mps)
        smallest, fault = inspect(scenario, waypoints, speed_mps)
        if not fault:
            return Solution(
                certificate=Certificate.FEASIBLE,
                speed_mps=speed_mps,
                straight_m=task.straight_m,
                waypoints=waypoints,
                clearance_m=smallest,
            )
        reason = fault
    return Solution(
        certificate=Certificate.INFEASIBLE if task.proof else Certificate.UNDECIDED,
        speed_mps=speed_mps,
        straight_m=task.straight_m,
        reason=task.proof or reason,
    )


def _undecided(scenario: Scenario, speed_mps: float, reason: str) -> Solution:
    return Solution(
        certificate=Certificate.UNDECIDED,
        speed_mps=speed_mps,
        straight_m=distance(scenario.start_m, scenario.goal_m),
        reason=reason,
    )


def _about_discs(scenario: Scenario) -> str:
    """Why a task with a footprint is undecided."""
    within = disc_within(scenario)
    proof = (
        "no circle of it holds base_link, so there is no proof that there is none"
        if within is None
        else f"no proof that there is none for the disc of {within.robot_radius_m:g} m within it"
    )
    return f"no path found for the disc around the footprint, and {proof}"


def _timed(scenario: Scenario, points: np.ndarray, speed_mps: float) -> tuple[Waypoint, ...]:
    """Waypoints along a polyline from t = 0 on; its ends are the scenario's start and goal."""
    corners = [scenario.start_m, *map(tuple, points[1:-1].tolist()), scenario.goal_m]
    waypoints = [Waypoint(0.0, *scenario.start_m)]
    travelled = 0.0
    for before, (x, y) in zip(corners, corners[1:]):
        travelled += math.dist(before, (x, y))
        waypoints.append(Waypoint(travelled / speed_mps, x, y))
    return tuple(waypoints)


def _length(points: np.ndarray) -> float:
    return float(lengths(points[None])[0])


class _Task:
    """State of the search in one world for one speed."""

    def __init__(
        self,
        scenario: Scenario,
        speed_mps: float,
        params: SearchParams,
        inside: Walls | None,
        of_proof: Scenario | None,
    ) -> None:
        self.of_proof = of_proof  # the task whose infeasibility counts; None: there is no proof
        self.scenario, self.v, self.params, self.inside = scenario, speed_mps, params, inside
        self.straight = np.array([scenario.start_m, scenario.goal_m])
        self.straight_m = distance(scenario.start_m, scenario.goal_m)
        self.active: set[int] = set()  # numbers of obstacles, ends of walls among them
        self.walls, self.active_walls = StaticWalls.of(scenario), set[int]()
        self.ends = WallEnds(scenario) if self.walls else None
        self.to_go: DistanceToGo | None = None  # past the walls; None: the straight line
        self.least_m = self.straight_m  # a bit above the shortest path past the walls alone
        self.past_walls: np.ndarray | None = None  # that path
        self.proof = ""

    def paths(self) -> Iterator[np.ndarray]:
        """Candidate paths, best first; a costlier search runs only when the last one failed."""
        limit_s = self.scenario.time_limit_s
        straight_s = self.straight_m / self.v
        if straight_s > limit_s:
            self.proof = f"the straight path alone takes {straight_s:g} s of {limit_s:g} s"
            return
        horizon_s = min(limit_s, 1.5 * straight_s + 5.0)
        segments = self._segments(horizon_s)
        touched = self._touched(self.straight, segments)
        if not (touched or self.walls.touched(self.straight, CLEAR_M / 2.0)):
            yield self.straight
            return
        self.active |= {number for number in touched if number < len(self.scenario.obstacles)}
        if self.walls:
            self._look_past_walls()
            horizon_s = min(limit_s, 1.5 * self.least_m / self.v + 5.0)
            segments = self._segments(horizon_s)
        if found := self._refined(self._by_tangents(segments, horizon_s), segments):
            yield from self._compared_with_lattice(found, segments)
            return
        if self.of_proof:
            moving = uniform_segments(self.of_proof, limit_s)
            self.proof = unreachable(self.of_proof, self.v, moving)
        if self.proof:
            return
        segments = self._segments(limit_s)
        if horizon_s < limit_s and (
            found := self._refined(self._by_tangents(segments, limit_s), segments)
        ):
            yield from self._compared_with_lattice(found, segments)
            return
        for times in (1.25, 2.5, 5.0):
            until_s = min(limit_s, times * self.least_m / self.v)
            if found := self._refined(self._by_lattice(segments, until_s, _COARSE), segments):
                yield from found
                return

    def _segments(self, until_s: float) -> UniformSegments:
        """The motion of all obstacles, and the ends of all walls at rest."""
        segments = uniform_segments(self.scenario, until_s)
        return self.ends.added_to(segments, until_s) if self.ends else segments

    def _look_past_walls(self) -> None:
        """Find a short path past the walls alone; those near it become active.

        Without one those that the straight line touches become active.
        """
        start = self.scenario.start_m
        self.to_go = DistanceToGo(self.scenario)
        for spare_cells in (0.8, 0.0):
            rough = DistanceToGo(self.scenario, spare_cells=spare_cells).rough_path(start)
            pulled = self.walls.pulled(rough, CLEAR_M)
            if self.walls.clear_path(pulled) and within(self.inside, *pulled.T).all():
                self.past_walls, self.least_m = pulled, _length(pulled)
                self._activate_walls(self.walls.touched(pulled, 0.5 * self.walls.radius_m))
                return
        self._activate_walls(self.walls.touched(self.straight, CLEAR_M / 2.0))

    def _activate_walls(self, walls: set[int]) -> None:
        self.active_walls |= walls
        if self.ends:
            self.active |= self.ends.of_walls(walls)

    def _activate(self, path: np.ndarray, segments: UniformSegments) -> bool:
        """Make active what a path touches; whether any of it was not."""
        touched = self._touched(path, segments)
        walls = self.walls.touched(path, CLEAR_M / 2.0)
        is_new = bool(touched - self.active or walls - self.active_walls)
        self.active |= touched
        self._activate_walls(walls)
        return is_new

    def _refined(self, paths: list[np.ndarray], segments: UniformSegments) -> list[np.ndarray]:
        """The refined paths, shortest first."""
        tried = (refine(path, self.v, segments, self.inside, self.walls) for path in paths)
        return sorted((points for points in tried if points is not None), key=_length)

    def _compared_with_lattice(
        self, paths: list[np.ndarray], segments: UniformSegments
    ) -> list[np.ndarray]:
        """The paths, and those of the lattice search where the tangent path is long.

        A long path often has to wait for a gap to open; the tangent search handles waiting
        poorly.
        """
        best_m = _length(paths[0])
        if best_m <= _LONG * self.least_m:
            return paths
        params = _FINE if best_m <= _VERY_LONG * self.least_m else _COARSE
        others = self._refined(self._by_lattice(segments, best_m / self.v, params), segments)
        return sorted([*paths, *others], key=_length)

    def _touched(self, path: np.ndarray, segments: UniformSegments) -> set[int]:
        """Obstacles, and ends of walls, that a path touches."""
        gap = gaps(path[None], self.v, segments)[0]
        return set(segments.obstacle[(gap < CLEAR_M / 2.0).any(axis=0)].tolist())

    def _is_free(self, path: np.ndarray, segments: UniformSegments) -> bool:
        return not (self._touched(path, segments) or self.walls.touched(path, CLEAR_M / 2.0))

    def _by_tangents(self, segments: UniformSegments, until_s: float) -> list[np.ndarray]:
        """Shortest paths among active obstacles; obstacles the best one touches become active.

        A path shortest among some obstacles and free of all is shortest among all. With too many
        walls near the path the one known is all there is.
        """
        start, goal = self.scenario.start_m, self.scenario.goal_m
        known = []
        if self.past_walls is not None and self._is_free(self.past_walls, segments):
            known.append(self.past_walls)
        bound_s = _length(known[0]) / self.v if known else math.inf
        most = _MOST_ACTIVE if known else _MOST_ACTIVE_UNKNOWN
        while len(self.active) <= most:
            paths = Search(
                start,
                goal,
                self.v,
                segments.select(sorted(self.active)),
                self.params,
                self.inside,
                until_s,
                self.walls.select(self.active_walls),
                self.to_go,
                bound_s,
            ).paths()
            if not paths:
                return known
            if not self._activate(paths[0], segments):
                return [path for path in paths if self._is_free(path, segments)] or known
        return known

    def _by_lattice(
        self, segments: UniformSegments, limit_s: float, params: LatticeParams
    ) -> list[np.ndarray]:
        start, goal = self.scenario.start_m, self.scenario.goal_m
        return lattice_paths(
            start, goal, self.v, segments, limit_s, params, self.inside, self.walls, self.to_go
        )
