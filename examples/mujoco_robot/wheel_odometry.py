# SPDX-License-Identifier: Apache-2.0
"""Odometry as a robot computes it: distance from wheel encoders, heading from them and a gyro.

It drifts: the wheels slip, their radii and distance are not quite what the software believes, an
encoder counts whole ticks, and the gyro has a bias and noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mfba_planner.core.geometry import Pose2D, wrap_angle


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryErrors:
    """Standard deviations of what is drawn once per robot, and of the gyro's noise."""

    wheel_radius_share: float = 0.003  # of each wheel
    wheel_apart_share: float = 0.01
    gyro_bias_radps: float = 0.0005  # what is left after its calibration at rest
    gyro_noise_radps: float = 0.005  # of one reading
    encoder_ticks: int = 2048  # per turn of a wheel
    gyro_weight: float = 0.95  # of the turn by the gyro, beside that by the wheels


class WheelOdometry:
    """Dead reckoning from wheel angles and turn rates, call by call."""

    def __init__(
        self,
        start: Pose2D,
        wheel_radius_m: float,
        wheel_apart_m: float,
        errors: OdometryErrors,
        rng: np.random.Generator,
    ) -> None:
        """Draw this robot's calibration; the first pose is exact."""
        self._errors, self._rng = errors, rng
        left, right, apart, bias = rng.normal(size=4).tolist()
        self._left_m = wheel_radius_m * (1.0 + errors.wheel_radius_share * left)
        self._right_m = wheel_radius_m * (1.0 + errors.wheel_radius_share * right)
        self._apart_m = wheel_apart_m * (1.0 + errors.wheel_apart_share * apart)
        self._bias_radps = errors.gyro_bias_radps * bias
        self.pose = start
        self.speed_mps = self.turn_radps = 0.0
        self._counted = (0, 0)

    def update(
        self, left_rad: float, right_rad: float, turn_radps: float, period_s: float
    ) -> None:
        """Take the wheels' angles since the start, and the mean turn rate of the last period."""
        errors, (left_before, right_before) = self._errors, self._counted
        per_rad = errors.encoder_ticks / (2.0 * math.pi)
        left, right = math.floor(left_rad * per_rad), math.floor(right_rad * per_rad)
        self._counted = (left, right)
        left_m = (left - left_before) / per_rad * self._left_m
        right_m = (right - right_before) / per_rad * self._right_m
        noise = errors.gyro_noise_radps * float(self._rng.normal())
        by_gyro = (turn_radps + self._bias_radps + noise) * period_s
        by_wheels = (right_m - left_m) / self._apart_m
        turn = errors.gyro_weight * by_gyro + (1.0 - errors.gyro_weight) * by_wheels
        ahead = 0.5 * (left_m + right_m)
        middle = self.pose.yaw + 0.5 * turn
        self.pose = Pose2D(
            self.pose.x + ahead * math.cos(middle),
            self.pose.y + ahead * math.sin(middle),
            wrap_angle(self.pose.yaw + turn),
        )
        self.speed_mps, self.turn_radps = ahead / period_s, turn / period_s

    def put(self, pose: Pose2D) -> None:
        """Continue from another pose, as a localisation that has found itself again."""
        self.pose = pose
