# SPDX-License-Identifier: Apache-2.0
"""Sector ranges from a laser scan, for the sensory vector (eq. 11)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..core.errors import InputError
from ..core.geometry import Point, rotated
from ..core.lidar_extrinsics import CENTRED, LidarExtrinsics
from ..core.planner_types import Ranges, Scan
from .scan_coverage import covered_sectors, covers_a_full_turn, usable_beams
from .sensory_vector import SensorParams, mark_sectors, single_precision

# A driver may send the first beam of the next turn as well, and rounds the increment.
FULL_TURN_RAD = 1.01 * 2.0 * math.pi


def aligned(scan: Scan, yaw_rad: float, extrinsics: LidarExtrinsics = CENTRED) -> Scan:
    """The scan in a frame aligned with odom, in which the robot has the yaw yaw_rad."""
    scan = _upright(scan, extrinsics)
    return replace(
        scan,
        angle_min_rad=scan.angle_min_rad + (yaw_rad + extrinsics.yaw_rad),
        origin_m=rotated(extrinsics.offset_m, yaw_rad),
    )


def _upright(scan: Scan, extrinsics: LidarExtrinsics) -> Scan:
    """The scan as seen from above; its beams keep their sequence, which is that of their times."""
    if not extrinsics.flipped:
        return scan
    first, step = -scan.angle_min_rad, -scan.angle_increment_rad
    return replace(scan, angle_min_rad=first, angle_increment_rad=step)


def require_usable(scan: Scan, yaw_rad: float, offset_m: Point) -> np.ndarray:
    """Which beams of a scan tell something, (n,); InputError if none, or for odd geometry."""
    geometry = (
        scan.angle_min_rad, scan.angle_increment_rad, scan.range_min_m, yaw_rad, *offset_m
    )  # fmt: skip
    if not all(map(math.isfinite, geometry)) or not scan.range_max_m > scan.range_min_m >= 0.0:
        raise InputError(
            f"scan geometry angle_min={scan.angle_min_rad}, increment={scan.angle_increment_rad},"
            f" range=[{scan.range_min_m}, {scan.range_max_m}], yaw={yaw_rad}: unusable;"
            " check the lidar driver"
        )
    size = len(scan.ranges_m)
    turn_rad = abs(scan.angle_increment_rad) * (size - 1)
    if size > 1 and not 0.0 < turn_rad <= FULL_TURN_RAD:
        raise InputError(
            f"scan of {size} beams with angle_increment={scan.angle_increment_rad}: they span "
            f"{turn_rad:.4g} rad, not more than 0 and at most a full turn; check the lidar driver"
        )
    known = usable_beams(scan)
    if not known.any():
        raise InputError(
            f"scan of {size} beams without one usable range; check the lidar, and "
            "scan_no_return if its driver reports free space otherwise than by inf"
        )
    return known


def sense_scan(
    scan: Scan,
    yaw_rad: float,
    robot_radius_m: float,
    params: SensorParams,
    extrinsics: LidarExtrinsics = CENTRED,
) -> Ranges:
    """Range per sector from a laser scan; every return is a point enlarged by the robot.

    yaw_rad is the yaw of the robot in the sectors' frame. As in REP-117, +inf is free
    space and -inf an obstacle nearer than range_min (taken at range_min); NaN and values outside
    [range_min, range_max] tell nothing. A sector that no beam covers reads 0.0: it is not known
    to be free. Raises InputError for a scan without any usable beam or with unusable geometry.
    """
    scan, yaw_rad = _upright(scan, extrinsics), yaw_rad + extrinsics.yaw_rad
    r = np.asarray(scan.ranges_m, dtype=np.float64)
    near, known = np.isneginf(r), require_usable(scan, yaw_rad, extrinsics.offset_m)
    hits = known & ~np.isposinf(r)
    d = np.where(near, scan.range_min_m, r)
    ox, oy = rotated(extrinsics.offset_m, yaw_rad - extrinsics.yaw_rad)
    reach_m = params.sensing_range_m + math.sqrt(ox * ox + oy * oy)
    hits &= np.where(hits, d, np.inf) - robot_radius_m <= reach_m
    angles = scan.angles_rad(np.flatnonzero(hits)) + yaw_rad
    ranges = [math.inf] * params.sectors
    for distance_m, angle in zip(d[hits].tolist(), angles.tolist()):
        if ox or oy:
            x, y = ox + distance_m * math.cos(angle), oy + distance_m * math.sin(angle)
            distance_m, angle = math.sqrt(x * x + y * y), math.atan2(y, x)
            if distance_m - robot_radius_m > params.sensing_range_m:
                continue
        mark_sectors(ranges, distance_m, robot_radius_m, angle)
    if not covers_a_full_turn(scan, known):
        placed = replace(scan, origin_m=rotated(extrinsics.offset_m, -extrinsics.yaw_rad))
        for sector in np.flatnonzero(~covered_sectors(placed, known, params.sectors, -yaw_rad)):
            ranges[sector] = 0.0
    return single_precision(ranges)
