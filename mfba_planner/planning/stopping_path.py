# SPDX-License-Identifier: Apache-2.0
"""The path of a differential base until it can stand, and the velocity that keeps it clear."""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, Pose2D, rotated
from ..core.planner_types import NANO
from ..core.robot_base import Base
from .differential_drive import Speeds, apply_command, heading_error, heading_law
from .obstacles_at_rest import STOPPING_TICKS

SHARES = (1.0, 0.7, 0.4, 0.2)  # of a velocity, the last also sideways
SIDEWAYS_RAD = (0.15, -0.15, 0.3, -0.3, 0.6, -0.6)  # past something that is grazed
ALIGNED_RAD = math.radians(3.0)  # so near to the velocity's heading, turning does not help
CREEP_MPS = 0.005  # the heading law turns towards a velocity, which is not 0
_STEP_S = 0.02
_NEARER_M = 2e-4  # what is in contact already must not come nearer


def stopping_path(
    velocity: Point, remaining_m: float, yaw_rad: float, speeds: Speeds, base: Base, tick_s: float
) -> np.ndarray:
    """Positions (k, 2), m, relative to the robot: one every 0.02 s until the base stands.

    The velocity is wanted for STOPPING_TICKS; the decision after it may be to stop.
    """
    wanted = heading_law(velocity, remaining_m, yaw_rad, base, tick_s)
    held = math.ceil(STOPPING_TICKS * tick_s / _STEP_S)
    step_ns, pose = round(_STEP_S / NANO), Pose2D(0.0, 0.0, yaw_rad)
    found: list[Point] = []
    while len(found) < held or speeds.v != 0.0:
        commanded = wanted if len(found) < held else Speeds()
        pose, speeds = apply_command(pose, speeds, commanded, base, step_ns)
        found.append(pose.position)
    return np.array(found)


def clear_velocity(
    velocity: Point,
    remaining_m: float,
    yaw_rad: float,
    speeds: Speeds,
    base: Base,
    tick_s: float,
    standing: np.ndarray,
) -> tuple[Point, float]:
    """The largest share of a velocity whose stopping path touches nothing, and that share.

    standing: rows (x, y, r), relative to the robot, enlarged by its radius. Where no share is
    allowed the base drives a little sideways, or turns in place until one is; else it turns in
    place towards the velocity, and along it it stops.
    """
    if not standing.shape[0] or velocity == (0.0, 0.0):
        return velocity, 1.0
    x, y, r = standing.T
    limit = np.minimum(r, np.sqrt(x * x + y * y) - _NEARER_M)

    def is_clear(wanted: Point, yaw_rad: float, speeds: Speeds) -> bool:
        path = stopping_path(wanted, remaining_m, yaw_rad, speeds, base, tick_s)
        away = np.sqrt((path[:, :1] - x) ** 2 + (path[:, 1:] - y) ** 2)
        return bool((away >= limit).all())

    for share in SHARES:
        scaled = (share * velocity[0], share * velocity[1])
        if is_clear(scaled, yaw_rad, speeds):
            return scaled, share
    for wanted in (scaled, *(rotated(scaled, angle) for angle in SIDEWAYS_RAD)):
        turn, _ = heading_error(wanted, yaw_rad, base)
        # While it turns it hardly moves: what counts is where it drives once it has turned.
        if not is_clear(wanted, yaw_rad + turn, Speeds()):
            continue
        if is_clear(wanted, yaw_rad, speeds):
            return wanted, share
        if abs(turn) > ALIGNED_RAD:
            return turn_in_place(yaw_rad, turn, base), 0.0
    turn, _ = heading_error(velocity, yaw_rad, base)
    still = abs(turn) <= ALIGNED_RAD
    return (0.0, 0.0) if still else turn_in_place(yaw_rad, turn, base), 0.0


def turn_in_place(yaw_rad: float, turn: float, base: Base) -> Point:
    """A velocity to which the heading law turns, to the side of `turn`, without driving."""
    heading = yaw_rad + math.copysign(0.5 * (base.turn_first_rad + 0.5 * math.pi), turn)
    return (CREEP_MPS * math.cos(heading), CREEP_MPS * math.sin(heading))
