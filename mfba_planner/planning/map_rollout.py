# SPDX-License-Identifier: Apache-2.0
"""Rollouts of many waypoints through a place at once: their risk from what stands and moves.

A rollout drives to its waypoint and then along the shortest way (distance_to_go.py). A base that
drives in any direction follows it exactly; for a differential base the heading law of
differential_drive.py is integrated within its limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point
from ..core.planner_types import Circle
from ..core.robot_base import Base
from ..perception.distance_field import DistanceField
from .differential_drive import Speeds
from .distance_to_go import DistanceToGo
from .drive_rollout import COARSE_TICKS, LONGEST, REACHED_M
from .trajectory_cost import SLOW, RiskParams

Array = np.ndarray

CONTACT_M = 0.02  # beyond the robot's radius: the end of a wall is seen a beam too short
CLOSE_M = 1.0  # cost of a pass beside what stands without clearance
FORBIDDEN_M = 1000.0  # cost of a contact before the waypoint with what stands
CARROT_M = 0.4  # a differential base aims so far ahead along the shortest way
SLOW_ROOM_M, SLOWEST = 0.15, 0.4  # room below which a differential base slows down, and to what
TIGHT_M, PIVOT_RAD = 0.04, 0.15  # with so little room it turns in place, to within so much
FINE_STEPS = 12  # of a differential base, of one tick; then come those of COARSE_TICKS
_ROUNDING = 1.0 - 1e-9


@dataclass(frozen=True, slots=True)
class Paths:
    """Positions (m, t + 1), duration of the steps (t,), driving time and steps to waypoints.

    slowed_m: how far a differential base stays behind until the waypoint by slowing down near what
    stands; the distance to go counts it after that.
    """

    x: Array
    y: Array
    step_s: Array
    driven_s: Array  # (m, t + 1)
    arrived: Array  # (m,) number of the step that ends at the waypoint
    slowed_m: Array  # (m,)


class MapRollout:
    """From one state of the robot, in the map's frame."""

    def __init__(
        self,
        position: Point,
        yaw_rad: float,
        speeds: Speeds,
        base: Base,
        radius_m: float,
        speed_mps: float,
        tick_s: float,
        to_go: DistanceToGo,
        clearance: DistanceField,
        circles: Sequence[Circle],
        horizon_s: float,
    ) -> None:
        """clearance: distances to what stands around the robot; circles: what moves, enlarged."""
        self._position, self._yaw, self._speeds = position, yaw_rad, speeds
        self._base, self._radius_m, self._full = base, radius_m, speed_mps
        if base.turns:
            self._full = min(speed_mps, base.max_speed_mps)
        self._tick_s, self._to_go, self._clearance = tick_s, to_go, clearance
        self._horizon_s = horizon_s
        rows = np.array([(*c.center_m, *c.velocity_mps, c.radius_m) for c in circles])
        if len(circles):
            speed = np.sqrt(rows[:, 2] ** 2 + rows[:, 3] ** 2)
            reach = rows[:, 4] + 1.0 + (speed + self._full) * horizon_s
            away = (rows[:, 0] - position[0]) ** 2 + (rows[:, 1] - position[1]) ** 2
            rows = rows[away < reach * reach]
        self._circles = rows

    @property
    def alone(self) -> bool:
        """Whether nothing that moves is in reach."""
        return not len(self._circles)

    def paths(self, qx: Array, qy: Array, t1: Array, horizon_s: float | None = None) -> Paths:
        """Rollouts through waypoints (m,), relative to the robot, reached after t1 (m,) s.

        They end at the waypoints where nothing moves: what stands is in the distance to go.
        """
        horizon_s = horizon_s or self._horizon_s
        if self._base.turns:
            return self._turning(qx, qy, t1, horizon_s)
        if self.alone:
            return self._straight(qx, qy, t1)
        (px, py), h, full = self._position, self._tick_s, self._full
        m = qx.size
        steps = math.ceil(horizon_s / h)
        longest = math.ceil(
            (horizon_s + float((t1 - np.sqrt(qx * qx + qy * qy) / full).max())) / h
        )
        steps = min(max(steps, longest), math.ceil(LONGEST * horizon_s / h))
        xs, ys = np.empty((m, steps + 1)), np.empty((m, steps + 1))
        driven = np.zeros((m, steps + 1))
        x, y = np.full(m, px), np.full(m, py)
        qx, qy = qx + px, qy + py
        first_m = np.sqrt((qx - px) ** 2 + (qy - py) ** 2) / t1 * h
        arrived = np.full(m, steps)
        on_first = np.ones(m, dtype=bool)
        gx, gy = self._to_go.goal
        xs[:, 0], ys[:, 0] = x, y
        any_first, any_second = True, False
        for k in range(steps):
            if any_first:
                dx, dy = qx - x, qy - y
                left = np.sqrt(dx * dx + dy * dy)
                scale = 1.0 / np.maximum(left, 1e-12)
                dx, dy, length = dx * scale, dy * scale, np.minimum(first_m, left)
            if any_second:
                ax, ay = self._to_go.direction(x, y)
                goal_x, goal_y = gx - x, gy - y
                on_m = np.minimum(full * h, np.sqrt(goal_x * goal_x + goal_y * goal_y))
                if any_first:
                    ax, ay = np.where(on_first, dx, ax), np.where(on_first, dy, ay)
                    on_m = np.where(on_first, length, on_m)
                dx, dy, length = ax, ay, on_m
            x, y = x + length * dx, y + length * dy
            xs[:, k + 1], ys[:, k + 1] = x, y
            driven[:, k + 1] = driven[:, k] + length / full
            if any_first:
                reached = on_first & (left <= first_m * (1.0 + 1e-9))
                arrived[reached] = k + 1
                on_first &= ~reached
                any_first, any_second = bool(on_first.any()), not on_first.all()
        return Paths(xs, ys, np.full(steps, h), driven, arrived, np.zeros(m))

    def _straight(self, qx: Array, qy: Array, t1: Array) -> Paths:
        """The straight lines to the waypoints alone."""
        length = np.sqrt(qx * qx + qy * qy)
        step_m = self._full * self._tick_s
        steps = max(math.ceil(float(length.max()) / step_m), 1)
        share = np.linspace(0.0, 1.0, steps + 1)
        (px, py), driven = self._position, length[:, None] * share / self._full
        x, y = px + qx[:, None] * share, py + qy[:, None] * share
        step_s = np.full(steps, self._tick_s)
        m = qx.size
        return Paths(x, y, step_s, driven, np.full(m, steps), np.zeros(m))

    def _turning(self, qx: Array, qy: Array, t1: Array, horizon_s: float) -> Paths:
        base, full, (px, py) = self._base, self._full, self._position
        accel, alpha = base.max_accel_mps2, base.max_turn_accel_radps2
        fastest, first_rad = base.max_turn_radps, base.turn_first_rad
        if self._is_tight():  # as stopping_path.clear_velocity will
            first_rad = min(first_rad, PIVOT_RAD)
        held_s = self._tick_s  # a command's
        m = qx.size
        left = max(math.ceil(LONGEST * horizon_s / held_s) - FINE_STEPS, 0)
        coarse = [COARSE_TICKS * held_s] * math.ceil(left / COARSE_TICKS)
        step_s = np.array([held_s] * FINE_STEPS + coarse)
        steps, t = step_s.size, 0.0
        xs, ys = np.empty((m, steps + 1)), np.empty((m, steps + 1))
        driven, slowed_m = np.zeros((m, steps + 1)), np.zeros(m)
        x, y, yaw = np.full(m, px), np.full(m, py), np.full(m, self._yaw)
        v, omega = np.full(m, self._speeds.v), np.full(m, self._speeds.omega)
        first = np.sqrt(qx * qx + qy * qy) / (t1 * full)
        qx, qy = qx + px, qy + py
        waits, waiting_mps = first < SLOW, full * first
        any_waits = bool(waits.any())
        longest_wait_s = float(t1[waits].max()) if any_waits else 0.0
        gx, gy = self._to_go.goal
        arrived = np.full(m, steps)
        on_first = np.ones(m, dtype=bool)
        fastest_mps = max(full, abs(self._speeds.v))
        braking_m = fastest_mps * (held_s + 0.5 * fastest_mps / accel)
        farthest_m = fastest_mps * float(step_s.sum()) + braking_m
        near_goal = (gx - px) ** 2 + (gy - py) ** 2 < farthest_m * farthest_m
        xs[:, 0], ys[:, 0] = x, y
        for k, h in enumerate(step_s.tolist()):
            most, most_turn = accel * h, alpha * h
            dx, dy = qx - x, qy - y
            if not self.alone and not on_first.all():
                ax, ay = self._to_go.direction(x, y)
                dx = np.where(on_first, dx, CARROT_M * ax)
                dy = np.where(on_first, dy, CARROT_M * ay)
            error = np.arctan2(dy, dx) - yaw
            error = np.remainder(error + math.pi, 2.0 * math.pi) - math.pi
            back = np.abs(error) > 0.5 * math.pi if base.reverse else None
            if back is not None and back.any():
                error = np.where(back, np.remainder(error, 2.0 * math.pi) - math.pi, error)
                error = np.where(error > math.pi, error - 2.0 * math.pi, error)
            else:
                back = None
            off = np.abs(error)
            turn = np.copysign(np.minimum(_brake(off, alpha, held_s), fastest), error)
            room = self._clearance.at(x, y) - self._radius_m
            share = np.minimum(np.maximum(room / SLOW_ROOM_M, SLOWEST), 1.0)
            wanted = full * share
            if any_waits and t < longest_wait_s:
                wanted = np.where(waits & (t < t1), waiting_mps, wanted)
            if near_goal:
                goal_x, goal_y = gx - x, gy - y
                goal_m = np.sqrt(goal_x * goal_x + goal_y * goal_y)
                wanted = np.minimum(wanted, _brake(goal_m, accel, held_s))
            wanted = wanted * np.maximum(1.0 - off / first_rad, 0.0)
            if back is not None:
                wanted = np.where(back, -wanted, wanted)
            before, v = v, v + np.minimum(np.maximum(wanted - v, -most), most)
            change = v - before
            mean = v - 0.5 * change * np.abs(change) / most
            before, omega = (
                omega,
                omega + np.minimum(np.maximum(turn - omega, -most_turn), most_turn),
            )
            change = omega - before
            mean_turn = omega - 0.5 * change * np.abs(change) / most_turn
            middle = yaw + 0.5 * mean_turn * h
            x, y, yaw = (
                x + mean * np.cos(middle) * h,
                y + mean * np.sin(middle) * h,
                yaw + mean_turn * h,
            )
            xs[:, k + 1], ys[:, k + 1] = x, y
            ahead_m = np.abs(mean) * h
            driven[:, k + 1] = driven[:, k] + ahead_m / full
            slowed_m += np.where(on_first, ahead_m * (1.0 / share - 1.0), 0.0)
            t += h
            if on_first.any():
                reach = np.maximum(REACHED_M, np.abs(v) * h)
                dx, dy = qx - x, qy - y
                ended = dx * dx + dy * dy < reach * reach
                if any_waits:
                    ended = np.where(waits, t >= t1, ended)
                reached = on_first & ended
                arrived[reached] = k + 1
                on_first &= ~reached
            if not on_first.any() if self.alone else float(driven[:, k + 1].min()) >= horizon_s:
                steps = k + 1
                break
        arrived, n = np.minimum(arrived, steps), steps + 1
        xs, ys, driven = xs[:, :n], ys[:, :n], driven[:, :n]
        if self.alone:  # beyond its waypoint a path does not count, however long the others are
            ends = np.minimum(np.arange(n), arrived[:, None])
            xs, ys, driven = (np.take_along_axis(a, ends, axis=1) for a in (xs, ys, driven))
        return Paths(xs, ys, step_s[:steps], driven, arrived, slowed_m)

    def _is_tight(self) -> bool:
        px, py = self._position
        room = float(self._clearance.at(np.array([px]), np.array([py]))[0]) - self._radius_m
        return room < TIGHT_M

    def standing_risk(self, paths: Paths, risk: RiskParams, margin_m: float) -> Array:
        """Risk (m,) of what stands; FORBIDDEN_M more for a contact before the waypoint."""
        d = self._clearance.at(paths.x, paths.y)
        now = float(d[0, 0])
        limit = min(self._radius_m + CONTACT_M, now - 0.002)
        left = 1.0 - paths.driven_s / risk.horizon_s
        ahead = left > 0.0
        left = np.maximum(left, 0.0)
        contact = (d < limit) & ahead
        contact[:, 0] = False
        missing = np.clip((limit + margin_m - d) / margin_m, 0.0, 1.0)
        found: Array = (CLOSE_M * missing * missing * left)[:, 1:].max(axis=1)
        if not contact.any():
            return found
        first = np.where(contact.any(axis=1), contact.argmax(axis=1), d.shape[1])
        hit = first < d.shape[1]
        urgency = np.zeros(d.shape[0])
        urgency[hit] = left[hit, first[hit]] ** 2
        found = found + urgency * (risk.contact_m + risk.urgent_m * urgency**3)
        found[hit & (first <= paths.arrived)] += FORBIDDEN_M
        return found

    def moving_risk(self, paths: Paths, risk: RiskParams) -> Array:
        """Risk (m,) of circles that keep their velocities; the formula of TrajectoryCost."""
        m = paths.x.shape[0]
        if self.alone:
            return np.zeros(m)
        around = [
            risk.around(math.hypot(*row[2:4]), self._tick_s) for row in self._circles.tolist()
        ]
        rows = np.concatenate((self._circles, np.array(around)), axis=1)
        cx, cy, vx, vy, r, margin, close = rows.T[:, :, None, None]
        h, tau = paths.step_s, risk.horizon_s
        t = np.cumsum(h) - h
        x = cx + vx * t - paths.x[:, :-1]
        y = cy + vy * t - paths.y[:, :-1]
        wx = vx - (paths.x[:, 1:] - paths.x[:, :-1]) / h
        wy = vy - (paths.y[:, 1:] - paths.y[:, :-1]) / h
        b = x * wx + y * wy
        a = wx * wx + wy * wy + 1e-12
        away = x * x + y * y
        at = np.clip(-b / a, 0.0, h)
        c = (a * at + 2.0 * b) * at + away
        driven = paths.driven_s[:, :-1]
        outer = (r + margin) ** 2
        near = (b < 0.0) & (c < np.minimum(outer, away * _ROUNDING)) & (driven < tau)
        if not near.any():
            return np.zeros(m)
        left = 1.0 - (driven + at) / tau
        missing = np.minimum(1.0 - (np.sqrt(np.maximum(c, 0.0)) - r) / margin, 1.0)
        found = np.where(near, close * missing * np.maximum(left, 0.0), 0.0)
        hit = near & (c < r * r)
        if hit.any():
            under = np.maximum(b * b - a * (away - r * r), 0.0)
            met = np.clip((-b - np.sqrt(under)) / a, 0.0, h)
            urgency = np.maximum(1.0 - (driven + met) / tau, 0.0) ** 2
            found = found + np.where(
                hit, urgency * (risk.contact_m + risk.urgent_m * urgency**3), 0.0
            )
        worst: Array = found.max(axis=(0, 2))
        return worst


def _brake(remaining: Array, deceleration: float, held_s: float) -> Array:
    """differential_drive.brake() of many distances."""
    root: Array = np.sqrt(held_s * held_s + 2.0 * remaining / deceleration)
    return deceleration * (root - held_s)
