# SPDX-License-Identifier: Apache-2.0
"""Rollouts of a differential base: its heading law, within its limits, for many waypoints at once.

Every operation on arrays costs more than its arithmetic here, so that position (x, y), speeds
(v, omega) and what is wanted of both are arrays (2, m), and what can be is left until after the
last step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point
from ..core.robot_base import Base
from ..perception.bilinear_grid import BilinearGrid
from ..perception.distance_field import DistanceField
from .differential_drive import Speeds
from .distance_to_go import DistanceToGo
from .drive_rollout import COARSE_TICKS, LATE_S, LATE_TICKS, LONGEST, REACHED_M
from .trajectory_cost import SLOW

Array = np.ndarray

CARROT_M = 0.4  # the base aims so far ahead along the shortest way
SLOW_ROOM_M, SLOWEST = 0.15, 0.4  # room below which the base slows down, and to what
TIGHT_M, PIVOT_RAD = 0.04, 0.15  # with so little room it turns in place, to within so much
FINE_STEPS = 12  # of one tick; then come those of COARSE_TICKS, and of LATE_TICKS after LATE_S


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


def speed_share(clearance: DistanceField, radius_m: float) -> BilinearGrid:
    """Share of the full speed by the room beside what stands around the robot; 1 elsewhere."""
    share = (clearance.distance_m - radius_m) / SLOW_ROOM_M
    share = np.minimum(np.maximum(share, SLOWEST), 1.0)
    share[[0, -1]] = share[:, [0, -1]] = 1.0
    return BilinearGrid(share, clearance.origin_m, clearance.cell_m)


@dataclass(frozen=True, slots=True)
class TurningRollout:
    """From one state of the base; alone: nothing that moves is in reach."""

    base: Base
    position: Point
    yaw_rad: float
    speeds: Speeds
    full_mps: float
    tick_s: float
    to_go: DistanceToGo
    share: BilinearGrid
    tight: bool
    alone: bool

    def paths(self, qx: Array, qy: Array, t1: Array, horizon_s: float) -> Paths:
        """Rollouts through waypoints (m,), relative to the robot, reached after t1 (m,) s.

        Where nothing moves they end there.
        """
        base, full, held_s = self.base, self.full_mps, self.tick_s  # how long a command is held
        accel, alpha = base.max_accel_mps2, base.max_turn_accel_radps2
        first_rad = base.turn_first_rad
        if self.tight:  # as stopping_path.clear_velocity will
            first_rad = min(first_rad, PIVOT_RAD)
        m, step_s = qx.size, self._steps(horizon_s)
        steps, t = step_s.size, 0.0
        xy = np.empty((steps + 1, 2, m))
        shares, ahead = np.empty((steps, m)), np.empty((steps, m))
        here = np.array(self.position)[:, None]
        waypoint = np.stack((qx, qy)) + here
        at, yaw = np.repeat(here, m, axis=1), np.full(m, self.yaw_rad)
        now = np.repeat(np.array([[self.speeds.v], [self.speeds.omega]]), m, axis=1)
        wanted = np.empty((2, m))
        share_1 = np.sqrt(qx * qx + qy * qy) / (t1 * full)
        waits, waiting_mps = share_1 < SLOW, full * share_1
        longest_wait_s = float(t1[waits].max()) if waits.any() else 0.0
        arrived, on_first = np.full(m, steps), np.ones(m, dtype=bool)
        goal = np.array(self.to_go.goal)[:, None]
        near_goal = self._comes_near(goal, step_s)
        limit = np.array([[accel], [alpha]])
        left, any_first, all_first = waypoint - at, True, True
        xy[0] = at
        for k, h in enumerate(step_s.tolist()):
            if not self.alone and not all_first:
                left = np.where(on_first, left, CARROT_M * self.to_go.direction(at))
            error = np.arctan2(left[1], left[0])
            error -= yaw
            error += math.pi
            np.remainder(error, 2.0 * math.pi, out=error)
            error -= math.pi
            back = _turn_round(error) if base.reverse else None
            off = np.abs(error)
            turn = _brake(off, alpha, held_s)
            np.minimum(turn, base.max_turn_radps, out=turn)
            np.copysign(turn, error, out=wanted[1])
            share = self.share.at(at)
            shares[k] = share
            speed = full * share
            if t < longest_wait_s:
                speed = np.where(waits & (t < t1), waiting_mps, speed)
            if near_goal:
                goal_x, goal_y = goal - at
                goal_m = np.sqrt(goal_x * goal_x + goal_y * goal_y)
                speed = np.minimum(speed, _brake(goal_m, accel, held_s))
            off /= -first_rad
            off += 1.0
            np.maximum(off, 0.0, out=off)
            np.multiply(speed, off, out=wanted[0])
            if back is not None:
                np.negative(wanted[0], out=wanted[0], where=back)
            most = limit * h
            change = wanted - now
            np.minimum(change, most, out=change)
            np.maximum(change, -most, out=change)
            now += change
            change *= np.abs(change)
            change *= 0.5 / most
            # The mean over a step whose start is spent on changing speed.
            mean = now - change
            mean *= h
            on_m, on_rad = mean
            middle = 0.5 * on_rad
            middle += yaw
            at[0] += on_m * np.cos(middle)
            at[1] += on_m * np.sin(middle)
            yaw += on_rad
            xy[k + 1] = at
            np.abs(on_m, out=ahead[k])
            t += h
            left = waypoint - at
            if any_first:
                away = left * left
                reach = now[0] * h
                reach *= reach
                ended = away[0] + away[1] < np.maximum(reach, REACHED_M * REACHED_M)
                if longest_wait_s:
                    ended = np.where(waits, t >= t1, ended)
                reached = on_first & ended
                if reached.any():
                    arrived[reached] = k + 1
                    on_first &= ~reached
                    any_first, all_first = bool(on_first.any()), False
            if self.alone:
                done = not any_first
            else:
                done = t >= horizon_s and float(ahead[: k + 1].sum(axis=0).min()) >= (
                    horizon_s * full
                )
            if done:
                steps = k + 1
                break
        return self._made(xy, shares, ahead, step_s[:steps], np.minimum(arrived, steps))

    def _steps(self, horizon_s: float) -> Array:
        """Durations of the steps, s."""
        tick_s, longest_s = self.tick_s, LONGEST * horizon_s
        found, t = list[float](), 0.0
        while t < longest_s - 1e-9:
            ticks = COARSE_TICKS if t < LATE_S - 1e-9 else LATE_TICKS
            found.append(tick_s if len(found) < FINE_STEPS else ticks * tick_s)
            t += found[-1]
        return np.array(found)

    def _comes_near(self, goal: Array, step_s: Array) -> bool:
        """Whether any rollout may have to brake for the goal."""
        fastest = max(self.full_mps, abs(self.speeds.v))
        braking_m = fastest * (self.tick_s + 0.5 * fastest / self.base.max_accel_mps2)
        farthest_m = fastest * float(step_s.sum()) + braking_m
        dx, dy = goal[:, 0] - self.position
        return bool(dx * dx + dy * dy < farthest_m * farthest_m)

    def _made(
        self, xy: Array, shares: Array, ahead: Array, step_s: Array, arrived: Array
    ) -> Paths:
        steps, full = step_s.size, self.full_mps
        shares, ahead = shares[:steps], ahead[:steps]
        number = np.arange(steps)[:, None]
        slowed_m = np.where(number < arrived, ahead * (1.0 / shares - 1.0), 0.0).sum(axis=0)
        driven_s = np.zeros((steps + 1, arrived.size))
        np.cumsum(ahead / full, axis=0, out=driven_s[1:])
        x, y, driven_s = xy[: steps + 1, 0].T, xy[: steps + 1, 1].T, driven_s.T
        if self.alone:  # beyond its waypoint a path does not count, however long the others are
            ends = np.minimum(np.arange(steps + 1), arrived[:, None])
            x, y, driven_s = (np.take_along_axis(a, ends, axis=1) for a in (x, y, driven_s))
        return Paths(x, y, step_s, driven_s, arrived, slowed_m)


def _turn_round(error: Array) -> Array | None:
    """Where driving backwards needs less of a turn: change the error (m,), and tell where."""
    back: Array = np.abs(error) > 0.5 * math.pi
    if not back.any():
        return None
    turned = np.remainder(error, 2.0 * math.pi) - math.pi
    np.copyto(error, turned, where=back)
    return back


def _brake(remaining: Array, deceleration: float, held_s: float) -> Array:
    """differential_drive.brake() of many distances."""
    held_mps = deceleration * held_s
    found: Array = remaining * (2.0 * deceleration)
    found += held_mps * held_mps
    np.sqrt(found, out=found)
    found -= held_mps
    return found
