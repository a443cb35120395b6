# SPDX-License-Identifier: Apache-2.0
"""Dynamic window approach: the best admissible one of sampled velocities (Fox 1997)."""

from __future__ import annotations

import math

import numpy as np

from ...core.geometry import Point
from ...core.planner_types import NANO, Observation
from ..base_planner import Move
from ..mode_transitions import Event
from .circle_planner import CirclePlanner

HEADINGS, SPEEDS = 36, (1.0, 2.0 / 3.0, 1.0 / 3.0, 0.0)
HORIZON_S = 2.0
PROGRESS, CLEARANCE = 1.0, 0.005  # weights of metres towards the goal and of 1 / clearance
NEAREST_M = 0.05  # clearance below which a velocity is admissible only if nothing is better


class DynamicWindow(CirclePlanner):
    """Velocities of an omnidirectional robot, held for HORIZON_S, circles at constant velocity.

    The window is the whole disc of velocities, as this robot has no acceleration limit.
    Objective: PROGRESS times the approach to the goal, minus CLEARANCE over the smallest gap.
    """

    def __init__(self, *args: object) -> None:
        """Prepare the samples."""
        super().__init__(*args)  # type: ignore[arg-type]
        angles = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._samples = self.params.speed_mps * np.concatenate(
            [share * ring for share in SPEEDS if share] + [np.zeros((1, 2))]
        )

    def move(self, obs: Observation, goal: Point) -> Move:
        """The sample with the best objective."""
        ahead = self.straight(obs.pose.position, goal, self.params.speed_mps)
        rows = self.circle_rows(obs)
        if not rows.size:
            return Move(velocity=ahead, reason="nothing within SR")
        samples = np.concatenate([self._samples, [ahead]])
        gap = self.gaps(rows, samples)
        gx, gy = goal[0] - obs.pose.x, goal[1] - obs.pose.y
        distance_m = math.hypot(gx, gy)
        duration = max(
            min(HORIZON_S, distance_m / self.params.speed_mps), self.params.tick_ns * NANO
        )
        gained = distance_m - np.hypot(
            gx - samples[:, 0] * duration, gy - samples[:, 1] * duration
        )
        value = PROGRESS * gained - CLEARANCE / np.maximum(gap, NEAREST_M)
        value[gap < NEAREST_M] = -1e6 + gap[gap < NEAREST_M]
        best = int(value.argmax())
        safe = gap[best] >= NEAREST_M
        return Move(
            velocity=(float(samples[best, 0]), float(samples[best, 1])),
            reason=f"{len(rows)} in range: smallest gap {gap[best]:.2f} m within the horizon",
            event=Event.OBSTACLE if safe else Event.NO_GAP,
        )

    @staticmethod
    def gaps(rows: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Smallest distance to any enlarged edge within the horizon, per sample; (m,), metres."""
        x, y, vx, vy, radius = rows.T[:, :, None]
        wx, wy = vx - samples[:, 0], vy - samples[:, 1]
        t = np.clip(-(x * wx + y * wy) / np.maximum(wx * wx + wy * wy, 1e-12), 0.0, HORIZON_S)
        gap: np.ndarray = (np.hypot(x + t * wx, y + t * wy) - radius).min(axis=0)
        return gap
