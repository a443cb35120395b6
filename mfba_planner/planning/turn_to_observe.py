# SPDX-License-Identifier: Apache-2.0
"""A base that turns, where no observed heading leads on: it turns in place, so that one may."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..core.geometry import wrap_angle
from ..core.robot_base import Base
from .base_planner import Move
from .differential_drive import Speeds
from .mode_transitions import Event
from .stopping_path import turn_in_place

TURNING_RADPS = 0.1  # from here on it turns already, and goes on in that direction


def turn_to_observe(
    move: Move,
    unobserved: np.ndarray,
    wanted_rad: float,
    yaw_rad: float,
    speeds: Speeds,
    base: Base,
) -> Move:
    """The blocked move, turning towards the unobserved heading nearest to the wanted one.

    unobserved (n,): whether heading k (from 1), at k 2 pi / n from +x, is not observed; one is.
    """
    headings = 2.0 * math.pi / unobserved.size * (np.flatnonzero(unobserved) + 1)
    off = np.abs(np.remainder(headings - wanted_rad + math.pi, 2.0 * math.pi) - math.pi)
    turn = wrap_angle(float(headings[off.argmin()]) - yaw_rad)
    if abs(speeds.omega) > TURNING_RADPS:
        turn = speeds.omega
    return replace(
        move,
        velocity=turn_in_place(yaw_rad, turn, base),
        reason=f"{move.reason}; turns to where the lidar has not covered",
        event=Event.OBSTACLE,
    )
