# SPDX-License-Identifier: Apache-2.0
"""Rollouts of many waypoints through a place at once: their risk from what stands and moves.

A rollout drives to its waypoint and then along the shortest way (distance_to_go.py). A base that
drives in any direction follows it exactly; for a differential base the heading law of
differential_drive.py is integrated within its limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.geometry import Point
from ..core.planner_types import Circle
from ..core.robot_base import Base
from ..perception.distance_field import DistanceField
from .differential_drive import Speeds
from .distance_to_go import DistanceToGo
from .drive_rollout import LONGEST
from .trajectory_cost import RiskParams
from .turning_rollout import TIGHT_M, Paths, TurningRollout, speed_share

Array = np.ndarray

CONTACT_M = 0.02  # beyond the robot's radius: the end of a wall is seen a beam too short
CLOSE_M = 1.0  # cost of a pass beside what stands without clearance
FORBIDDEN_M = 1000.0  # cost of a contact before the waypoint with what stands
_ROUNDING = 1.0 - 1e-9


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
        self._turning: TurningRollout | None = None

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
            return self._of_the_base().paths(qx, qy, t1, horizon_s)
        if self.alone:
            return self._straight(qx, qy)
        h, full, m = self._tick_s, self._full, qx.size
        steps = math.ceil(horizon_s / h)
        length_m = np.sqrt(qx * qx + qy * qy)
        longest = math.ceil((horizon_s + float((t1 - length_m / full).max())) / h)
        steps = min(max(steps, longest), math.ceil(LONGEST * horizon_s / h))
        here = np.array(self._position)[:, None]
        at, waypoint = np.repeat(here, m, axis=1), np.stack((qx, qy)) + here
        xy, driven_m = np.empty((steps + 1, 2, m)), np.empty((steps, m))
        first_m = length_m / t1 * h
        reached_m = first_m * (1.0 + 1e-9)
        arrived, on_first = np.full(m, steps), np.ones(m, dtype=bool)
        goal = np.array(self._to_go.goal)[:, None]
        xy[0] = at
        any_first, any_second = True, False
        for k in range(steps):
            if any_first:
                step = waypoint - at
                left_m = np.sqrt(step[0] * step[0] + step[1] * step[1])
                step /= np.maximum(left_m, 1e-12)
                step_m = np.minimum(first_m, left_m)
            if any_second:
                on, to_goal = self._to_go.direction(at), goal - at
                on_m = np.sqrt(to_goal[0] * to_goal[0] + to_goal[1] * to_goal[1])
                np.minimum(on_m, full * h, out=on_m)
                if any_first:
                    on, on_m = np.where(on_first, step, on), np.where(on_first, step_m, on_m)
                step, step_m = on, on_m
            at = at + step_m * step
            xy[k + 1], driven_m[k] = at, step_m
            if any_first:
                reached = on_first & (left_m <= reached_m)
                if reached.any():
                    arrived[reached] = k + 1
                    on_first &= ~reached
                    any_first, any_second = bool(on_first.any()), True
        driven_s = np.zeros((steps + 1, m))
        np.cumsum(driven_m / full, axis=0, out=driven_s[1:])
        return Paths(xy[:, 0].T, xy[:, 1].T, np.full(steps, h), driven_s.T, arrived, np.zeros(m))

    def _straight(self, qx: Array, qy: Array) -> Paths:
        """The straight lines to the waypoints alone."""
        length = np.sqrt(qx * qx + qy * qy)
        step_m = self._full * self._tick_s
        steps = max(math.ceil(float(length.max()) / step_m), 1)
        # By steps of a tick, so that no other waypoint has a say in where a path is looked at.
        on_m = np.minimum(np.arange(steps + 1) * step_m, length[:, None])
        share = on_m / np.maximum(length, 1e-12)[:, None]
        (px, py), arrived = self._position, np.ceil(length / step_m).astype(int)
        x, y = px + qx[:, None] * share, py + qy[:, None] * share
        step_s = np.full(steps, self._tick_s)
        return Paths(x, y, step_s, on_m / self._full, arrived, np.zeros(qx.size))

    def _of_the_base(self) -> TurningRollout:
        """The rollout of a differential base."""
        if self._turning is None:
            share = speed_share(self._clearance, self._radius_m)
            self._turning = TurningRollout(
                self._base, self._position, self._yaw, self._speeds, self._full, self._tick_s,
                self._to_go, share, self._is_tight(), self.alone,
            )  # fmt: skip
        return self._turning

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

    def moving_risk(self, paths: Paths, risk: RiskParams, horizon_s: float | None = None) -> Array:
        """Risk (m,) of circles that keep their velocities; the formula of TrajectoryCost.

        Within the rollout's own horizon, if no other is given: what moves may need a longer one.
        """
        m = paths.x.shape[0]
        if self.alone:
            return np.zeros(m)
        around = [
            risk.around(math.hypot(*row[2:4]), self._tick_s) for row in self._circles.tolist()
        ]
        rows = np.concatenate((self._circles, np.array(around)), axis=1)
        cx, cy, vx, vy, r, margin, close = rows.T[:, :, None, None]
        h, tau = paths.step_s, horizon_s or self._horizon_s
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

    def touches(self, qx: Array, qy: Array, risk: RiskParams) -> Array:
        """Whether something is touched on the straight lines (m,), at full speed: bits (m,)."""
        paths = self._straight(qx, qy)
        horizon_s = max(float(paths.driven_s[:, -1].max()), 0.1)
        brief = replace(risk, horizon_s=horizon_s, close_m=0.0, fast_close_s=0.0)
        standing = self.standing_risk(paths, brief, CONTACT_M) >= FORBIDDEN_M
        moving = self.moving_risk(paths, brief, horizon_s) > 0.0
        found: Array = standing | moving
        return found
