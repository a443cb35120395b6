# SPDX-License-Identifier: Apache-2.0
"""Whether a robot stops within what it sees: the tick until its next decision, then braking."""

from __future__ import annotations

import math

from ..core.geometry import Point, distance
from ..core.planner_types import NANO
from .planner_params import PlannerParams

_ROUNDING_M = 1e-6


def stopping_distance_m(params: PlannerParams) -> float:
    """Distance driven from full speed to rest, if the next decision is to stop: v t + v^2 / 2a."""
    return _full_speed_mps(params) * params.tick_ns * NANO + _braking_m(params)


def _full_speed_mps(params: PlannerParams) -> float:
    return min(params.speed_mps, params.max_speed_mps) if params.turns else params.speed_mps


def _braking_m(params: PlannerParams) -> float:
    """An omnidirectional base has no limit of acceleration: it stops with the tick."""
    speed_mps = _full_speed_mps(params)
    return 0.5 * speed_mps * speed_mps / params.max_accel_mps2 if params.turns else 0.0


def too_fast_for_lidar(
    params: PlannerParams, range_max_m: float, origin_m: Point = (0.0, 0.0)
) -> str:
    """Why the robot does not stop within a lidar's range, with the remedy; "" if it does.

    Of a lidar beside the robot's centre the range counts from there on its other side.
    """
    offset_m = distance(origin_m, (0.0, 0.0))
    radius_m, range_max_m = params.robot_radius_m, range_max_m - offset_m
    fault = _too_fast(params, range_max_m - radius_m)
    if not fault:
        return ""
    farther_m = _up(radius_m + offset_m + stopping_distance_m(params))
    observed = f"the lidar's range of {range_max_m:g} m less robot_radius_m={radius_m:g}"
    return (
        f"{fault}: {observed}; {_slower(params, range_max_m - radius_m)}a lidar of {farther_m:g} m"
    )


def too_fast_for_sectors(params: PlannerParams, sensing_range_m: float) -> str:
    """Why the robot does not stop within the sensing range, which begins at its edge."""
    fault = _too_fast(params, sensing_range_m)
    if not fault:
        return ""
    farther_m = _up(stopping_distance_m(params))
    slower = _slower(params, sensing_range_m)
    return f"{fault}: sensing_range_m; {slower}sensing_range_m={farther_m:g}"


def _too_fast(params: PlannerParams, room_m: float) -> str:
    needed_m = stopping_distance_m(params)
    if needed_m <= room_m + _ROUNDING_M:
        return ""
    return (
        f"speed_mps={params.speed_mps:g}: the robot stops within {needed_m:.2f} m, "
        f"but sees only {max(room_m, 0.0):.2f} m ahead"
    )


def _slower(params: PlannerParams, room_m: float) -> str:
    """The speed or step that stops within room_m; "give" alone where none does.

    A tick lasts step length / speed, so a lower speed shortens the braking only.
    """
    spare_m = room_m - params.step_length_m
    if params.turns and spare_m > 0.0:
        speed_mps = _down(math.sqrt(2.0 * params.max_accel_mps2 * spare_m))
        if speed_mps > 0.0:
            return f"lower speed_mps to {speed_mps:g}, or give "
    room_of_tick_m = room_m - _braking_m(params)
    step_m = _down(room_of_tick_m * params.speed_mps / _full_speed_mps(params))
    return f"lower step_length_m to {step_m:g}, or give " if step_m > 0.0 else "give "


def _down(value: float) -> float:
    return math.floor(100.0 * (value + 0.1 * _ROUNDING_M)) / 100.0


def _up(value: float) -> float:
    return math.ceil(100.0 * (value - 0.1 * _ROUNDING_M)) / 100.0
