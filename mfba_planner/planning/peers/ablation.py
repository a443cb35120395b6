# SPDX-License-Identifier: Apache-2.0
"""Ablations: the predictive planner without one component; as MODULE:NAME in sweeps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.geometry import Point, wrap_angle
from ...core.planner_types import NANO, Circle, Observation
from ...perception.obstacle_memory import ObstacleMemoryParams
from ...perception.obstacle_tracker import Tracker
from ...perception.sensory_vector import SensorParams
from ...perception.static_map import StaticMap
from ...swarm.optimizer import Found
from ..base_planner import Move, blocked
from ..distance_to_go import DistanceToGo
from ..mode_transitions import Event
from ..planner_params import PlannerParams
from ..predictive_planner import Predictive, PredictiveParams
from ..trajectory_cost import Candidate, RiskParams, TrajectoryCost


class BitsOnly(Predictive):
    """Only predicted bits: the free heading nearest to the goal's, or stop."""

    def move(self, obs: Observation, goal: Point) -> Move:
        """Straight if free, else along the nearest free heading at full speed, else stop."""
        (x, y), speed = obs.pose.position, self.params.speed_mps
        straight = self.straight((x, y), goal, speed)
        circles = self._circles(obs)
        if not circles:
            return Move(velocity=straight, reason="no obstacle within SR")
        costs = TrajectoryCost((x, y), circles, self.options.risk, self.params.tick_ns * NANO)
        straight_ux_uy = self._cos[:1] * 0.0 + straight[0], self._sin[:1] * 0.0 + straight[1]
        if not costs.closed(*straight_ux_uy)[0]:
            return Move(velocity=straight, reason="the straight way is free")
        vs = tuple(costs.closed(self._cos * speed, self._sin * speed).tolist())
        if all(vs):
            return blocked("every heading closes", vs)
        goal_heading = math.atan2(goal[1] - y, goal[0] - x)
        free = [k for k, closed in enumerate(vs) if not closed]
        k = min(free, key=lambda k: abs(wrap_angle(self._heading(k) - goal_heading)))
        return Move(
            velocity=(float(self._cos[k]) * speed, float(self._sin[k]) * speed),
            reason="the nearest free heading",
            event=Event.OBSTACLE,
            vs=vs,
            vg=vs,
            gap=k + 1,
        )

    def _heading(self, k: int) -> float:
        return math.atan2(self._sin[k], self._cos[k])


class NoBats(Predictive):
    """The best candidate waypoint, not refined by bats."""

    has_bats = False

    def _refine(self, *_: Any) -> Found:
        return Found()


class NoWaiting(Predictive):
    """Always at full speed."""

    def _waypoints(self, gaps: list[int], to_goal: Point, goal_distance: float) -> list[Candidate]:
        full = 0.999 * self.params.speed_mps
        candidates = super()._waypoints(gaps, to_goal, goal_distance)
        return [c for c in candidates if math.hypot(*c[1]) > full * c[2]]


class NoLastWaypoint(Predictive):
    """The search does not use the waypoint of the last tick."""

    def move(self, obs: Observation, goal: Point) -> Move:
        """As Predictive, without the last waypoint."""
        self._waypoint = None
        return super().move(obs, goal)


def no_margins(params: PlannerParams, sensor: SensorParams, seed: int) -> Predictive:
    """Close passes cost nothing; only contacts do."""
    risk = RiskParams(close_m=0.0, margin_m=1e-6, margin_ticks=0.0)
    return Predictive(params, sensor, seed, PredictiveParams(risk=risk))


def no_memory(params: PlannerParams, sensor: SensorParams, seed: int) -> Predictive:
    """Circles out of range are dropped at once."""
    memory = ObstacleMemoryParams(path_m=0.0, longest_s=0.0)
    return Predictive(params, sensor, seed, PredictiveParams(memory=memory))


class NoVelocities(Predictive):
    """All circles are assumed to be at rest: no prediction."""

    def _circles(self, obs: Observation) -> Sequence[Circle]:
        return [replace(circle, velocity_mps=(0.0, 0.0)) for circle in super()._circles(obs)]


class NoMap(Predictive):
    """From a scan: tracked circles alone, without a map of what stands."""

    has_map = False


class NoDistanceToGo(Predictive):
    """The map, but in eq. 1 the straight line to the goal whatever stands on it."""

    def forget(self) -> None:
        """As Predictive."""
        super().forget()
        search = self._map_planning.search
        search.to_go = _StraightToGo(self.options.route, self.params.robot_radius_m)


class _StraightToGo(DistanceToGo):
    def update(self, stamp_ns: int, known: StaticMap, position: Point, goal: Point) -> None:
        self.goal = goal


class NoTracker(Predictive):
    """The map alone: what moves is kept out of it, and otherwise unknown."""

    def forget(self) -> None:
        """As Predictive."""
        super().forget()
        self.tracker = _NothingTracked(self.options.tracking)


class _NothingTracked(Tracker):
    def circles(self, now_ns: int, robot_radius_m: float) -> tuple[Circle, ...]:
        return ()

    def moving(self) -> tuple[np.ndarray, np.ndarray]:
        return np.empty((0, 5)), np.empty(0, dtype=bool)
