# SPDX-License-Identifier: Apache-2.0
"""Artificial potential field: attracted by the goal, repelled by obstacles (Khatib 1986)."""

from __future__ import annotations

import math

import numpy as np

from ...core.geometry import Point
from ...core.planner_types import Observation
from ..base_planner import Move, blocked
from ..mode_transitions import Event
from .circle_planner import CirclePlanner

REPULSION = 0.3  # relative to the attraction, which has length 1
NEAREST_M = 0.02  # the repulsion does not grow below this distance


class PotentialField(CirclePlanner):
    """Full speed along the sum of the forces; no escape from local minima.

    Force: unit vector to the goal, plus REPULSION (1/d - 1/SR) / d^2 away from each enlarged
    edge at distance d < SR.
    """

    def move(self, obs: Observation, goal: Point) -> Move:
        """Follow the force."""
        px, py = obs.pose.position
        gx, gy = goal[0] - px, goal[1] - py
        distance_m = math.hypot(gx, gy)
        fx, fy = gx / distance_m, gy / distance_m
        rows = self.circle_rows(obs)
        if not rows.size:
            velocity = self.straight(obs.pose.position, goal, self.params.speed_mps)
            return Move(velocity=velocity, reason="nothing within SR")
        away = np.hypot(rows[:, 0], rows[:, 1])
        gap = np.maximum(away - rows[:, 4], NEAREST_M)
        push = REPULSION * np.maximum(1.0 / gap - 1.0 / self.sensor.sensing_range_m, 0.0)
        push /= gap * gap * np.maximum(away, 1e-9)
        fx -= float(push @ rows[:, 0])
        fy -= float(push @ rows[:, 1])
        force = math.hypot(fx, fy)
        reason = f"{len(rows)} repelling"
        if force < 1e-9:
            return blocked(f"{reason}: forces cancel")
        speed = self.params.speed_mps
        return Move(
            velocity=(speed * fx / force, speed * fy / force),
            reason=reason,
            event=Event.OBSTACLE,
        )
