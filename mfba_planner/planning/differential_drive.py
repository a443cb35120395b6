# SPDX-License-Identifier: Apache-2.0
"""Differential drive: the heading law from a goal step to (v, omega), and the simulated base."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..core.geometry import Point, Pose2D, bearing, distance, wrap_angle
from ..core.planner_types import NANO, Decision
from ..core.robot_base import Base

SUBTICK_NS = 10_000_000  # period at which speeds change within a tick


class Speeds(NamedTuple):
    """Forward speed (m/s) and rate of turn (rad/s)."""

    v: float = 0.0
    omega: float = 0.0


def command(decision: Decision, base: Base, tick_ns: int) -> Point:
    """The command for a base: velocity in the odom frame, or (v, omega) of a differential one."""
    return track(decision, base, tick_ns) if base.turns else decision.velocity


def track(decision: Decision, base: Base, tick_ns: int) -> Speeds:
    """The heading law of docs/robots.md: turn towards the goal step, slow down while turning.

    u is the wanted velocity, e the angle from the robot's heading to u (to -u where that is
    smaller and the base may reverse), d the distance to the goal:
    omega = sgn(e) min(omega_max, brake(|e|)), v = min(|u|, v_max, brake(d)) max(0, 1 - |e|/e_t).
    """
    if decision.goal is None:
        return Speeds()
    remaining = distance(decision.pose.position, decision.goal)
    return heading_law(decision.velocity, remaining, decision.pose.yaw, base, tick_ns * NANO)


def heading_law(
    velocity: Point, remaining_m: float, yaw_rad: float, base: Base, tick_s: float
) -> Speeds:
    """track() of a wanted velocity, m/s, with remaining_m left to the goal."""
    ux, uy = velocity
    wanted = math.sqrt(ux * ux + uy * uy)
    if wanted == 0.0:
        return Speeds()
    error, sign = heading_error(velocity, yaw_rad, base)
    turn = min(base.max_turn_radps, brake(abs(error), base.max_turn_accel_radps2, tick_s))
    speed = min(wanted, base.max_speed_mps, brake(remaining_m, base.max_accel_mps2, tick_s))
    share = max(0.0, 1.0 - abs(error) / base.turn_first_rad)
    return Speeds(sign * speed * share, math.copysign(turn, error))


def heading_error(velocity: Point, yaw_rad: float, base: Base) -> tuple[float, float]:
    """Angle by which the base turns to drive at a velocity; 1 for forwards, -1 for backwards."""
    error = wrap_angle(bearing((0.0, 0.0), velocity) - yaw_rad)
    if base.reverse and abs(error) > 0.5 * math.pi:
        return wrap_angle(error + math.pi), -1.0
    return error, 1.0


def brake(remaining: float, deceleration: float, held_s: float) -> float:
    """The highest speed that still stops in time if it is held for t = held_s first.

    The root of v t + v^2 / 2a = d, d what remains (m or rad).
    """
    return deceleration * (math.sqrt(held_s * held_s + 2.0 * remaining / deceleration) - held_s)


def apply_command(
    pose: Pose2D, speeds: Speeds, commanded: Point, base: Base, tick_ns: int
) -> tuple[Pose2D, Speeds]:
    """The base after one tick: speeds follow the command within the limits, in subticks.

    v and omega change at the start of a subtick and hold during it. The arc of angle 2 h is
    integrated in closed form: a chord v t sin(h) / h along the mean of both headings.
    """
    count = max(1, -(-tick_ns // SUBTICK_NS))
    t = tick_ns * NANO / count
    v_target = min(max(commanded[0], -base.max_speed_mps), base.max_speed_mps)
    omega_target = min(max(commanded[1], -base.max_turn_radps), base.max_turn_radps)
    v, omega = speeds
    for _ in range(count):
        v = _approach(v, v_target, base.max_accel_mps2 * t)
        omega = _approach(omega, omega_target, base.max_turn_accel_radps2 * t)
        pose = arc(pose, v, omega, t)
    return pose, Speeds(v, omega)


def _approach(value: float, target: float, limit: float) -> float:
    return target if abs(target - value) <= limit else value + math.copysign(limit, target - value)


def arc(pose: Pose2D, v: float, omega: float, t_s: float) -> Pose2D:
    """Exact pose of a unicycle after t_s at constant speeds: an arc, or a line for omega = 0."""
    half = 0.5 * omega * t_s
    chord = v * t_s * (math.sin(half) / half if half else 1.0)
    middle = pose.yaw + half
    return Pose2D(
        pose.x + chord * math.cos(middle),
        pose.y + chord * math.sin(middle),
        wrap_angle(pose.yaw + 2.0 * half),
    )
