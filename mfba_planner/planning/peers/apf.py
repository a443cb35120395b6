# SPDX-License-Identifier: Apache-2.0
"""Artificial potential field: pulled by the goal, pushed by what is near (Khatib 1986)."""

from __future__ import annotations

import math

import numpy as np

from ...core.geometry import Point
from ...core.types import Observation
from ..base_planner import BasePlanner, Move
from ..mode_transitions import Event
from ..observed_circles import discs

REPULSION = 0.3  # of the pull, at the distance where 1/d - 1/SR is 1 per metre
NEAREST_M = 0.02  # gaps below this push no harder


class PotentialField(BasePlanner):
    """Full speed along the sum of the forces; stuck in a minimum, it pushes on at random no more.

    Force: unit vector to the goal, plus REPULSION (1/d - 1/SR) / d^2 away from each enlarged
    edge at distance d < SR.
    """

    reads_sectors = False

    def move(self, obs: Observation, goal: Point) -> Move:
        """Follow the force."""
        px, py = obs.pose.position
        gx, gy = goal[0] - px, goal[1] - py
        left = math.hypot(gx, gy)
        fx, fy = gx / left, gy / left
        around = discs(obs)
        if not around.size:
            velocity = self.straight(obs.pose.position, goal, self.params.speed_mps)
            return Move(velocity=velocity, reason="nothing within SR")
        away = np.hypot(around[:, 0], around[:, 1])
        gap = np.maximum(away - around[:, 4], NEAREST_M)
        push = REPULSION * np.maximum(1.0 / gap - 1.0 / self.sensor.sensing_range_m, 0.0)
        push /= gap * gap * np.maximum(away, 1e-9)
        fx -= float(push @ around[:, 0])
        fy -= float(push @ around[:, 1])
        force = math.hypot(fx, fy)
        reason = f"{len(around)} repelling"
        if force < 1e-9:
            return Move(velocity=(0.0, 0.0), reason=f"{reason}: forces cancel", event=Event.NO_GAP)
        speed = self.params.speed_mps
        return Move(
            velocity=(speed * fx / force, speed * fy / force),
            reason=reason,
            event=Event.OBSTACLE,
        )
