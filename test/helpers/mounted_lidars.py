# SPDX-License-Identifier: Apache-2.0
"""One wall as lidars with several extrinsics see it: exactly the same points.

The wall's posts stand where rays in whole degrees from the robot's centre and from a place
OFFSET_M ahead of it meet, so that a lidar of 360 beams at either place meets each of them.
"""

import math
from collections.abc import Callable

import numpy as np

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.lidar_extrinsics import LidarExtrinsics
from mfba_planner.core.planner_types import Scan

OFFSET_M, WALL_Y_M = 0.3, 0.7
BEAMS = 360
MOUNTED = {
    "straight": LidarExtrinsics(),
    "yawed": LidarExtrinsics(yaw_rad=0.5 * math.pi),
    "ahead": LidarExtrinsics(x_m=OFFSET_M),
    "flipped": LidarExtrinsics(flipped=True),
    "all": LidarExtrinsics(x_m=OFFSET_M, yaw_rad=-0.5 * math.pi, flipped=True),
}


def posts() -> dict[int, tuple[int, float, float]]:
    """By direction from the centre (degrees): that from ahead, and both distances."""
    found: dict[int, tuple[int, float, float]] = {}
    taken = set()
    for a in range(62, 119, 2):
        x = WALL_Y_M / math.tan(math.radians(a))
        b = round(math.degrees(math.atan2(WALL_Y_M, x - OFFSET_M)))
        between = math.sin(math.radians(b - a))
        if b in taken or between <= 0.05:
            continue
        taken.add(b)
        from_centre = OFFSET_M * math.sin(math.radians(b)) / between
        from_ahead = OFFSET_M * math.sin(math.radians(a)) / between
        found[a] = (b, from_centre, from_ahead)
    return found


def wall_ranges(mounted: LidarExtrinsics) -> np.ndarray:
    """The ranges (360,) of a lidar whose beam k points k degrees left of its x axis."""
    ranges = np.full(BEAMS, np.inf)
    for a, (b, from_centre, from_ahead) in posts().items():
        direction, range_m = (b, from_ahead) if mounted.x_m else (a, from_centre)
        beam = direction - round(math.degrees(mounted.yaw_rad))
        ranges[(-beam if mounted.flipped else beam) % BEAMS] = range_m
    return ranges.astype(np.float32).astype(np.float64)


def wall_scan(mounted: LidarExtrinsics) -> Scan:
    """The scan of that lidar, in its own frame."""
    return Scan(
        ranges_m=wall_ranges(mounted),
        angle_min_rad=0.0,
        angle_increment_rad=math.radians(1.0),
        range_min_m=0.1,
        range_max_m=3.5,
    )


def wall_points(pose: Pose2D) -> np.ndarray:
    """The posts (n, 2) in odom, for a robot at this pose."""
    angles = [math.radians(a) + pose.yaw for a in posts()]
    distances = [found[1] for found in posts().values()]
    return np.array(
        [
            (pose.x + d * math.cos(angle), pose.y + d * math.sin(angle))
            for angle, d in zip(angles, distances)
        ]
    )


# Two lidars, each of which tells nothing of a part of its turn; together they see all around.
FRONT, REAR = MOUNTED["ahead"], MOUNTED["flipped"]


def front_scan() -> Scan:
    """That ahead of the centre, in its own frame: 200 degrees ahead of it."""
    return _in_part(FRONT, lambda degrees: abs(degrees) <= 100)


def rear_scan() -> Scan:
    """That at the centre, upside down: all but 140 degrees ahead."""
    return _in_part(REAR, lambda degrees: abs(degrees) >= 70)


def _in_part(mounted: LidarExtrinsics, is_inside: Callable[[int], bool]) -> Scan:
    """is_inside: by the direction on the robot, from -180 to 179 degrees."""
    scan = wall_scan(mounted)
    for beam in range(BEAMS):
        degrees = -beam if mounted.flipped else beam
        if not is_inside((degrees + 180) % 360 - 180):
            scan.ranges_m[beam] = math.nan
    return scan
