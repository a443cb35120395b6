# SPDX-License-Identifier: Apache-2.0
"""Rollout of a differential drive: the path that it takes through a waypoint to the goal."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..core.geometry import Point
from ..core.robot_base import Base
from .differential_drive import Speeds, brake
from .turn_delay import TurnDelay

FINE_STEPS, COARSE_TICKS = 6, 2  # steps of one tick, then steps of two
LATE_S, LATE_TICKS = 3.0, 4  # and after so long of four
LONGEST = 2.0  # horizons, waiting and turning included
REACHED_M = 0.1  # at a waypoint the planner decides anew


class Stretch(NamedTuple):
    """A straight stretch: start (m), its time, driving time so far, velocity, duration."""

    x: float
    y: float
    t_s: float
    driven_s: float
    vx: float
    vy: float
    lasts_s: float


class DriveRollout:
    """The heading law of differential_drive, integrated within the limits of the base."""

    def __init__(
        self, base: Base, yaw_rad: float, speeds: Speeds, speed_mps: float, tick_s: float
    ) -> None:
        """The present heading and speeds; speed_mps is the planner's full speed."""
        self._base, self._yaw, self._speeds = base, yaw_rad, speeds
        self.full_mps, self._tick_s = min(speed_mps, base.max_speed_mps), tick_s
        self.turn_delay = TurnDelay(base, yaw_rad, speeds.omega)

    def stretches(
        self, waypoint: Point, wait_s: float, share: float, goal: Point, horizon_s: float
    ) -> list[Stretch]:
        """The path of the next horizon_s of driving, from (0, 0); waypoint and goal relative, m.

        Waiting and turning do not count, as they must not move a contact out of the horizon.

        The base drives to the waypoint and then to the goal; with wait_s it drives towards the
        goal instead, for that time at the given share of the speed, and then at full speed.
        """
        base, full, tick_s = self._base, self.full_mps, self._tick_s
        accel, alpha = base.max_accel_mps2, base.max_turn_accel_radps2
        fastest, first_rad, reverse = base.max_turn_radps, base.turn_first_rad, base.reverse
        v, omega = self._speeds
        x = y = t = driven = 0.0
        yaw = self._yaw
        (qx, qy), (gx, gy) = goal if wait_s else waypoint, goal
        found: list[Stretch] = []
        while driven < horizon_s and t < LONGEST * horizon_s:
            ticks = COARSE_TICKS if t < LATE_S else LATE_TICKS
            h = tick_s if len(found) < FINE_STEPS else ticks * tick_s
            dx, dy = qx - x, qy - y
            reached_m = max(REACHED_M, abs(v) * h)  # a longer step could pass it
            if dx * dx + dy * dy < reached_m * reached_m:
                qx, qy = gx, gy
                dx, dy = qx - x, qy - y
                if dx * dx + dy * dy < 1e-6:
                    break
            error = math.remainder(math.atan2(dy, dx) - yaw, 2.0 * math.pi)
            sign = 1.0
            if reverse and abs(error) > 0.5 * math.pi:
                error, sign = math.remainder(error + math.pi, 2.0 * math.pi), -1.0
            off = abs(error)
            # Held for the step: with the shorter tick the heading would oscillate.
            turn = math.copysign(min(brake(off, alpha, h), fastest), error)
            wanted = full * share if t < wait_s else full
            wanted = min(wanted, brake(math.hypot(gx - x, gy - y), accel, tick_s))
            wanted = sign * wanted * (1.0 - off / first_rad) if off < first_rad else 0.0
            most, most_turn = accel * h, alpha * h
            # The mean over a step whose start is spent on changing speed.
            before, v = v, v + min(max(wanted - v, -most), most)
            mean = v - 0.5 * (v - before) * abs(v - before) / most
            before, omega = omega, omega + min(max(turn - omega, -most_turn), most_turn)
            mean_turn = omega - 0.5 * (omega - before) * abs(omega - before) / most_turn
            middle = yaw + 0.5 * mean_turn * h
            vx, vy = mean * math.cos(middle), mean * math.sin(middle)
            found.append(Stretch(x, y, t, driven, vx, vy, h))
            x, y, yaw, t = x + vx * h, y + vy * h, yaw + mean_turn * h, t + h
            driven += abs(mean) * h / full
        return found
