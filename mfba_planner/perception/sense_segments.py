# SPDX-License-Identifier: Apache-2.0
"""Sector ranges of wall segments, for the sensory vector (eq. 11), beside those of circles."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ..core.errors import InputError
from ..core.geometry import Point
from ..core.planner_types import Ranges
from ..core.segments import Segments
from .sensory_vector import (
    TWO_PI,
    SensorParams,
    mark_sectors,
    sense_circles,
    single_precision,
)


def sense_circles_and_segments(
    position: Point,
    circles: Iterable[tuple[Point, float]],
    segments: Segments,
    robot_radius_m: float,
    params: SensorParams,
) -> Ranges:
    """sense_circles(), and the ranges of wall segments enlarged by the robot's radius (m).

    Every point of a segment counts as an obstacle of radius 0: what of it is within SR is sensed
    as the circles of the robot's radius round it. Raises InputError like sense_circles().
    """
    ranges = sense_circles(position, circles, params)
    if not segments.x.size:
        return ranges
    if not all(map(math.isfinite, position)):
        raise InputError(f"position {position}: not finite; send finite numbers")
    sensed = [math.inf] * params.sectors
    reach_m = params.sensing_range_m + robot_radius_m
    near = segments.near(position, reach_m)
    for x, y, dx, dy in zip(*(column.tolist() for column in near)):
        part = _within(x - position[0], y - position[1], dx, dy, reach_m)
        if part is not None:
            _mark_enlarged(sensed, *part, robot_radius_m)
    return tuple(map(min, ranges, single_precision(sensed)))


def _within(
    x: float, y: float, dx: float, dy: float, reach_m: float
) -> tuple[float, float, float, float] | None:
    """The part of a segment, (x, y) and (dx, dy), within reach of the origin; None for none."""
    square = dx * dx + dy * dy
    along = x * dx + y * dy
    excess = x * x + y * y - reach_m * reach_m
    root = along * along - square * excess
    if square == 0.0:
        return (x, y, 0.0, 0.0) if excess <= 0.0 else None
    if root < 0.0:
        return None
    first = max(0.0, (-along - math.sqrt(root)) / square)
    last = min(1.0, (-along + math.sqrt(root)) / square)
    if first > last:
        return None
    return (x + first * dx, y + first * dy, (last - first) * dx, (last - first) * dy)


def _mark_enlarged(
    ranges: list[float], x: float, y: float, dx: float, dy: float, radius: float
) -> None:
    """Lower the range of every sector that the segment, enlarged by the radius, touches."""
    length = math.sqrt(dx * dx + dy * dy)
    share = -(x * dx + y * dy) / (length * length) if length > 0.0 else 0.0
    share = min(1.0, max(0.0, share))
    nearest = (x + share * dx, y + share * dy)
    distance = math.sqrt(nearest[0] * nearest[0] + nearest[1] * nearest[1])
    if distance == 0.0:  # the robot's centre is on the wall
        ranges[:] = [0.0] * len(ranges)
        return
    mark_sectors(ranges, distance, radius, math.atan2(nearest[1], nearest[0]))
    if distance <= radius or length == 0.0:
        return
    for end_x, end_y in ((x, y), (x + dx, y + dy)):
        end_distance = math.sqrt(end_x * end_x + end_y * end_y)
        mark_sectors(ranges, end_distance, radius, math.atan2(end_y, end_x))
    # The near edge of the strip between the circles round the ends. Beyond an end of the strip
    # the circle round that end hides it.
    aside = (x * dy - y * dx) / length  # of the origin, to the left of the segment
    edge_m = abs(aside) - radius
    if edge_m > 0.0:
        side = math.copysign(1.0, aside)
        towards = math.atan2(-side * dx, side * dy)
        first = side * (x * dx + y * dy) / length  # counter-clockwise along the edge
        ends = (first, first + side * length)
        _mark_edge(ranges, edge_m, towards, min(ends), max(ends))


def _mark_edge(
    ranges: list[float], edge_m: float, towards: float, low_m: float, high_m: float
) -> None:
    """Mark a straight edge at edge_m in the direction towards, from low_m to high_m along it."""
    width = TWO_PI / len(ranges)
    low = towards + math.atan2(low_m, edge_m)
    high = towards + math.atan2(high_m, edge_m)
    for sector in range(math.floor(low / width), math.floor(high / width) + 1):
        first, last = max(low, sector * width), min(high, (sector + 1) * width)
        nearest = min(max(towards, first), last)
        r = edge_m / math.cos(nearest - towards)
        index = sector % len(ranges)
        if r < ranges[index]:
            ranges[index] = r
