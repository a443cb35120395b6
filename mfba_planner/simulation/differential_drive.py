# SPDX-License-Identifier: Apache-2.0
"""A differential drive: the law that makes (v, omega) of a goal step, and the base that obeys."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..core.geometry import Point, Pose2D, bearing, distance, wrap_angle
from ..core.types import NANO, Decision
from .robot_model import Base

SUBTICK_NS = 10_000_000  # speeds change this often within a tick


class Speeds(NamedTuple):
    """Forward speed (m/s) and rate of turn (rad/s)."""

    v: float = 0.0
    omega: float = 0.0


def command(decision: Decision, base: Base, tick_ns: int) -> Point:
    """What a base is told: the velocity in the odom frame, or a differential one's (v, omega)."""
    return track(decision, base, tick_ns) if base.turns else decision.velocity


def track(decision: Decision, base: Base, tick_ns: int) -> Speeds:
    """The heading law of docs/robots.md: turn towards the goal step, drive as far as it points.

    With u the wanted velocity, e the angle from the robot's heading to it (to -u when that is
    nearer and the base may reverse) and d the distance to the goal:
    omega = sgn(e) min(omega_max, brake(|e|)), v = min(|u|, v_max, brake(d)) max(0, 1 - |e|/e_t).
    """
    ux, uy = decision.velocity
    wanted = math.sqrt(ux * ux + uy * uy)
    if wanted == 0.0 or decision.goal is None:
        return Speeds()
    tick_s, way = tick_ns * NANO, 1.0
    error = wrap_angle(bearing((0.0, 0.0), (ux, uy)) - decision.pose.yaw)
    if base.reverse and abs(error) > 0.5 * math.pi:
        error, way = wrap_angle(error + math.pi), -1.0
    turn = min(base.max_turn_radps, brake(abs(error), base.max_turn_accel_radps2, tick_s))
    left = distance(decision.pose.position, decision.goal)
    speed = min(wanted, base.max_speed_mps, brake(left, base.max_accel_mps2, tick_s))
    share = max(0.0, 1.0 - abs(error) / base.turn_first_rad)
    return Speeds(way * speed * share, math.copysign(turn, error))


def brake(left: float, deceleration: float, held_s: float) -> float:
    """The highest speed from which one stops in time, when it is held for a while first.

    The root of v t + v^2 / 2a = d.
    """
    return deceleration * (math.sqrt(held_s * held_s + 2.0 * left / deceleration) - held_s)


def apply_command(
    pose: Pose2D, speeds: Speeds, told: Point, base: Base, tick_ns: int
) -> tuple[Pose2D, Speeds]:
    """The base after one tick: speeds follow within the limits, each subtick is an arc.

    v and omega change at the begin of a subtick and hold during it; its arc of angle 2 h is
    integrated in closed form, as its chord v t sin(h) / h in the middle of both headings.
    """
    count = max(1, -(-tick_ns // SUBTICK_NS))
    t = tick_ns * NANO / count
    v_told = min(max(told[0], -base.max_speed_mps), base.max_speed_mps)
    omega_told = min(max(told[1], -base.max_turn_radps), base.max_turn_radps)
    v, omega = speeds
    for _ in range(count):
        v = _nearer(v, v_told, base.max_accel_mps2 * t)
        omega = _nearer(omega, omega_told, base.max_turn_accel_radps2 * t)
        pose = arc(pose, v, omega, t)
    return pose, Speeds(v, omega)


def _nearer(value: float, target: float, most: float) -> float:
    return target if abs(target - value) <= most else value + math.copysign(most, target - value)


def arc(pose: Pose2D, v: float, omega: float, t_s: float) -> Pose2D:
    """A unicycle after t at constant speeds, exactly: an arc, or a line where omega is 0."""
    half = 0.5 * omega * t_s
    chord = v * t_s * (math.sin(half) / half if half else 1.0)
    middle = pose.yaw + half
    return Pose2D(
        pose.x + chord * math.cos(middle),
        pose.y + chord * math.sin(middle),
        wrap_angle(pose.yaw + 2.0 * half),
    )
