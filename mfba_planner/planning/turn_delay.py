# SPDX-License-Identifier: Apache-2.0
"""Turn delay: how long a differential drive stays behind while it turns towards a direction."""

from __future__ import annotations

import math

import numpy as np

from ..core.robot_base import Base

Array = np.ndarray


class TurnDelay:
    """The time lost by turning first, against a base that drives in any direction at once.

    The base turns by an angle e as fast as its limits allow: it speeds up at alpha to
    w_p = sqrt(alpha e + w^2 / 2), at most w_max, and slows down at alpha; w is its present rate
    towards the direction. That takes T = (w_p - w) / alpha + w_p / alpha, plus the stretch at
    w_max. The heading law drives at the share 1 - |e| / e_t of the speed (differential_drive), so
    of the last stretch, from e_t on, a third is lost, and of a smaller turn the mean of |e| / e_t.
    """

    def __init__(self, base: Base, yaw_rad: float = 0.0, turn_radps: float = 0.0) -> None:
        """The present heading and rate of turn."""
        self._yaw, self._turn = yaw_rad, turn_radps
        self._alpha, self._fastest = base.max_turn_accel_radps2, base.max_turn_radps
        self._first, self._reverse = base.turn_first_rad, base.reverse
        self._last_s = math.sqrt(2.0 * self._first / self._alpha)

    def towards(self, ux: float, uy: float) -> float:
        """Seconds lost before driving in the direction (ux, uy)."""
        error = math.remainder(math.atan2(uy, ux) - self._yaw, 2.0 * math.pi)
        if self._reverse and abs(error) > 0.5 * math.pi:
            error = math.remainder(error + math.pi, 2.0 * math.pi)
        rate = self._turn if error >= 0.0 else -self._turn
        return self._lost_s(abs(error), rate)

    def towards_all(self, ux: Array, uy: Array) -> Array:
        """towards() of many directions, each (m,)."""
        error = np.remainder(np.arctan2(uy, ux) - self._yaw + math.pi, 2.0 * math.pi) - math.pi
        if self._reverse:
            turned = np.remainder(error, 2.0 * math.pi) - math.pi
            error = np.where(np.abs(error) > 0.5 * math.pi, turned, error)
        rate = np.where(error >= 0.0, self._turn, -self._turn)
        error, alpha, fastest = np.abs(error), self._alpha, self._fastest
        peak = np.sqrt(alpha * error + 0.5 * rate * rate)
        held = np.maximum(peak * peak - fastest * fastest, 0.0) / (alpha * fastest)
        took = np.maximum((2.0 * np.minimum(peak, fastest) - rate) / alpha + held, 0.0)
        small = took * 0.5 * error / self._first
        lost: Array = np.maximum(took - self._last_s, 0.0) + self._last_s / 3.0
        lost[took == 0.0] = 0.0
        return np.where(error <= self._first, small, lost)

    def between(self, ux: float, uy: float, vx: float, vy: float) -> float:
        """Seconds lost between driving in the direction (ux, uy) and in (vx, vy)."""
        error = abs(math.atan2(ux * vy - uy * vx, ux * vx + uy * vy))
        if self._reverse and error > 0.5 * math.pi:
            error = math.pi - error
        return self._lost_s(error, 0.0)

    def _lost_s(self, error: float, rate: float) -> float:
        alpha, fastest = self._alpha, self._fastest
        peak = math.sqrt(alpha * error + 0.5 * rate * rate)
        if peak <= fastest:
            took = (2.0 * peak - rate) / alpha
        else:
            took = (2.0 * fastest - rate) / alpha + (peak * peak - fastest * fastest) / (
                alpha * fastest
            )
        if took <= 0.0:
            return 0.0
        if error <= self._first:
            return took * 0.5 * error / self._first
        return max(took - self._last_s, 0.0) + self._last_s / 3.0
