# SPDX-License-Identifier: Apache-2.0
"""The predictive planner without one ingredient, as mfba_planner.planning.peers.ablation:NAME."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from ...core.geometry import Point, wrap_angle
from ...core.types import NANO, Circle, Observation
from ...perception.obstacle_memory import ObstacleMemoryParams
from ...perception.sensory_vector import SensorParams
from ..base_planner import Move
from ..mode_transitions import Event
from ..planner_params import PlannerParams
from ..predictive import Predictive, PredictiveParams
from ..trajectory_cost import RiskParams, TrajectoryCost, Way


class BitsOnly(Predictive):
    """Predicted bits in the paper's manner: the free heading nearest to the goal's, or none."""

    def move(self, obs: Observation, goal: Point) -> Move:
        """Straight while that is free, else along a heading at full speed, else stand."""
        (x, y), speed = obs.pose.position, self.params.speed_mps
        straight = self.straight((x, y), goal, speed)
        circles = self._circles(obs)
        if not circles:
            return Move(velocity=straight, reason="no obstacle within SR")
        world = TrajectoryCost((x, y), circles, self.options.risk, self.params.tick_ns * NANO)
        goes = self._cos[:1] * 0.0 + straight[0], self._sin[:1] * 0.0 + straight[1]
        if not world.closed(*goes)[0]:
            return Move(velocity=straight, reason="the straight way is free")
        vs = tuple(world.closed(self._cos * speed, self._sin * speed).tolist())
        if all(vs):
            return Move(
                velocity=(0.0, 0.0),
                reason="every heading closes",
                event=Event.NO_GAP,
                vs=vs,
                vg=vs,
            )
        wanted = math.atan2(goal[1] - y, goal[0] - x)
        free = [k for k, closed in enumerate(vs) if not closed]
        k = min(free, key=lambda k: abs(wrap_angle(self._heading(k) - wanted)))
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
    """The best waypoint of bits, gaps and waiting, not refined."""

    def _fly(self, *_: Any) -> Any:
        return SimpleNamespace(best_value=math.inf, best_x=(0.0, 0.0), candidates=())


class NoWaiting(Predictive):
    """Always at full speed."""

    def _waypoints(self, gaps: list[int], to_goal: Point, left: float) -> list[Way]:
        full = 0.999 * self.params.speed_mps
        ways = super()._waypoints(gaps, to_goal, left)
        return [way for way in ways if math.hypot(*way[1]) > full * way[2]]


class NoLastWaypoint(Predictive):
    """Every tick begins its search anew."""

    def move(self, obs: Observation, goal: Point) -> Move:
        """As ever."""
        self._waypoint = None
        return super().move(obs, goal)


def no_margins(params: PlannerParams, sensor: SensorParams, seed: int) -> Predictive:
    """Any pass that is no contact is as good as any other."""
    risk = RiskParams(close_m=0.0, margin_m=1e-6, margin_ticks=0.0)
    return Predictive(params, sensor, seed, PredictiveParams(risk=risk))


def no_memory(params: PlannerParams, sensor: SensorParams, seed: int) -> Predictive:
    """Who leaves the sensing region is forgotten."""
    memory = ObstacleMemoryParams(path_m=0.0, longest_s=0.0)
    return Predictive(params, sensor, seed, PredictiveParams(memory=memory))


class NoVelocities(Predictive):
    """Everything around stands still, as far as it knows: no prediction."""

    def _circles(self, obs: Observation) -> Sequence[Circle]:
        return [replace(circle, velocity_mps=(0.0, 0.0)) for circle in super()._circles(obs)]
