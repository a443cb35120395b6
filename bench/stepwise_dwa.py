# SPDX-License-Identifier: Apache-2.0
"""`dwa` as tutorials (PythonRobotics) have it: one velocity after the other, step by step.

Only for measuring its cost: it samples, scores and chooses as planning/peers/dwa.py does.
"""

from __future__ import annotations

import numpy as np

from mfba_planner.planning.peers.dwa import HORIZON_S, DynamicWindow

STEP_S = 0.1  # the tutorial's, too


class StepwiseDwa(DynamicWindow):
    """A trajectory is simulated for every sample; its gap is the smallest at any of its steps."""

    @staticmethod
    def gaps(around: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Smallest distance to any enlarged edge at any step, per sample; (m,), metres."""
        return np.array([_gap(around, vx, vy) for vx, vy in samples.tolist()])


def _gap(around: np.ndarray, ux: float, uy: float) -> float:
    """Of one sample, whose trajectory begins at the robot, (0, 0)."""
    x = y = t = 0.0
    trajectory = [(x, y, t)]
    while t < HORIZON_S - 0.5 * STEP_S:
        x, y, t = x + ux * STEP_S, y + uy * STEP_S, t + STEP_S
        trajectory.append((x, y, t))
    xs, ys, times = np.array(trajectory).T[:, :, None]
    ox, oy, vx, vy, radius = around.T
    return float((np.hypot(ox + vx * times - xs, oy + vy * times - ys) - radius).min())
