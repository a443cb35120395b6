# SPDX-License-Identifier: Apache-2.0
"""Simulated lidar: ray casting against circles, segments and walls, and the resulting scan."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..core.geometry import Point, Pose2D, rotated
from ..core.planner_types import Scan
from ..core.segments import Segments
from .obstacle_motion import Walls
from .robot_model import Lidar

_FULL_CIRCLE_RAD = 2.0 * math.pi
_END_SLACK = 1e-9  # of a segment's length
_RAYS: dict[tuple[int, float], tuple[np.ndarray, np.ndarray]] = {}


def rays(
    beams: int, turned_rad: float = 0.0, fov_rad: float = _FULL_CIRCLE_RAD
) -> tuple[np.ndarray, np.ndarray]:
    """Cosines and sines of n beams along the middles of n equal shares of the view, each (n,).

    A view of a full circle begins at the x axis, a smaller one lies on both sides of it.
    """
    if (beams, fov_rad) not in _RAYS:
        angles = (np.arange(beams) + 0.5) * (fov_rad / beams)
        if fov_rad != _FULL_CIRCLE_RAD:
            angles -= 0.5 * fov_rad
        _RAYS[beams, fov_rad] = np.cos(angles), np.sin(angles)
    c, s = _RAYS[beams, fov_rad]
    if turned_rad == 0.0:
        return c, s
    ct, st = math.cos(turned_rad), math.sin(turned_rad)
    return ct * c - st * s, st * c + ct * s


def cast_rays(
    position: Point,
    circles: Sequence[tuple[float, float, float]],
    beams: int,
    longest_m: float,
    turned_rad: float = 0.0,
    fov_rad: float = _FULL_CIRCLE_RAD,
) -> np.ndarray:
    """Range of each beam to the nearest circle (x, y, radius), inf beyond longest_m; (n,), m.

    Inside a circle every range is 0.
    """
    if not circles:
        return np.full(beams, np.inf)
    c, s = rays(beams, turned_rad, fov_rad)
    x, y, r = np.array(circles).T[:, :, None]
    x, y = x - position[0], y - position[1]
    along = x * c + y * s
    outside = x * x + y * y - r * r
    under_root = along * along - outside
    ranges = along - np.sqrt(np.maximum(under_root, 0.0))
    ranges[(under_root < 0.0) | (along <= 0.0)] = np.inf
    ranges[np.broadcast_to(outside <= 0.0, ranges.shape)] = 0.0
    nearest = ranges.min(axis=0)
    nearest[nearest > longest_m] = np.inf
    return nearest


def cast_walls(
    position: Point,
    walls: Walls,
    beams: int,
    turned_rad: float = 0.0,
    fov_rad: float = _FULL_CIRCLE_RAD,
) -> np.ndarray:
    """Range of each beam to the walls, from inside or outside; inf for a miss; (n,), m."""
    enter, leave = np.full(beams, -np.inf), np.full(beams, np.inf)
    for origin, low, high, slope in zip(
        position, walls.lower_m, walls.upper_m, rays(beams, turned_rad, fov_rad)
    ):
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            a, b = (low - origin) / slope, (high - origin) / slope
        enter = np.fmax(enter, np.fmin(a, b))  # fmin ignores 0/0: a ray along the wall
        leave = np.fmin(leave, np.fmax(a, b))
    met = np.where(enter > 0.0, enter, leave)
    return np.where((enter <= leave) & (leave > 0.0), met, np.inf)


def cast_segments(
    position: Point,
    segments: Segments,
    beams: int,
    turned_rad: float = 0.0,
    fov_rad: float = _FULL_CIRCLE_RAD,
) -> np.ndarray:
    """Range of each beam to the nearest segment, inf for a miss; (n,), m.

    The ends belong to a segment, with a rounding error to spare: no beam passes between two that
    share an end. A beam exactly along a segment misses it, as a wall has no thickness.
    """
    c, s = rays(beams, turned_rad, fov_rad)
    x, y = segments.x[:, None] - position[0], segments.y[:, None] - position[1]
    dx, dy = segments.dx[:, None], segments.dy[:, None]
    across = c * dy - s * dx  # 0 along the segment
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ranges = (x * dy - y * dx) / across
        share = (x * s - y * c) / across
    hit = (ranges >= 0.0) & (share >= -_END_SLACK) & (share <= 1.0 + _END_SLACK)
    return np.where(hit, ranges, np.inf).min(axis=0, initial=np.inf)


def scan_at(
    pose: Pose2D,
    lidar: Lidar,
    circles: Sequence[tuple[float, float, float]],
    walls: Walls | None,
    segments: Segments | None = None,
) -> Scan:
    """The scan of real surfaces from this pose, in the lidar's own frame.

    REP-117: +inf beyond range_max, -inf below range_min. All numbers in single precision, as in
    a LaserScan.
    """
    turned, fov_rad = pose.yaw + lidar.yaw_rad, lidar.covered_rad
    dx, dy = rotated(lidar.extrinsics.offset_m, pose.yaw)
    origin = (pose.x + dx, pose.y + dy)
    ranges = cast_rays(origin, circles, lidar.beams, math.inf, turned, fov_rad)
    if walls is not None and lidar.walls:
        to_walls = cast_walls(origin, walls, lidar.beams, turned, fov_rad)
        ranges = np.minimum(ranges, to_walls)
    if segments is not None and segments.x.size:
        near = segments.near(origin, lidar.range_max_m)
        to_segments = cast_segments(origin, near, lidar.beams, turned, fov_rad)
        ranges = np.minimum(ranges, to_segments)
    if lidar.flipped:  # the shares of the view lie on both sides of its x axis alike
        ranges = ranges[::-1]
    increment = fov_rad / lidar.beams
    return Scan(
        ranges_m=limited(ranges, lidar),
        angle_min_rad=_single(lidar.first_beam_rad),
        angle_increment_rad=_single(increment),
        range_min_m=_single(lidar.range_min_m),
        range_max_m=_single(lidar.range_max_m),
    )


def limited(ranges_m: np.ndarray, lidar: Lidar) -> np.ndarray:
    """Ranges as a lidar reports them: too far is +inf, too near -inf; single precision."""
    far, near = ranges_m > lidar.range_max_m, ranges_m < lidar.range_min_m
    measured = np.where(far, np.inf, np.where(near, -np.inf, ranges_m))
    return measured.astype(np.float32).astype(np.float64)


def _single(value: float) -> float:
    return float(np.float32(value))
