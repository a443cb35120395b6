# SPDX-License-Identifier: Apache-2.0
"""The sensory vector Vs (eq. 11) and sector ranges from enlarged circles (Fig. 4, 5)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.geometry import Point, ray_circle_distance, tangent_half_angle
from ..core.option_specs import check, option
from ..core.planner_types import Bits, Ranges

TWO_PI = 2.0 * math.pi
FARTHER = 1.0 + 1e-9  # factor of a distance: surely beyond it in spite of rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorParams:
    """The ring of virtual sensors (Fig. 3)."""

    sectors: int = option(12, "number of equal sectors", minimum=3, maximum=3600)
    sensing_range_m: float = option(
        0.8, "SR, measured to the enlarged edge", unit="m", minimum=0.01, maximum=1000.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


def sensory_vector(ranges_m: Iterable[float]) -> Bits:
    """Vs of eq. 11: a(i) = 0 where sector i is free (+inf), 1 for any other range."""
    ranges = tuple(ranges_m)
    if ranges.count(math.inf) == len(ranges):
        return (0,) * len(ranges)  # the usual case
    return tuple([0 if r == math.inf else 1 for r in ranges])


def blind(sector: int, range_m: float) -> str:
    """The reason for refusing sectors with this range; sectors count from 1."""
    return f"sector {sector} holds {range_m}; the sensor was blind"


def longest_range_m(params: SensorParams, enlarged_radius_m: float) -> float:
    """Largest finite range a sector can report: along the tangent of a circle at SR.

    A circle whose near edge is SR away also sets the sectors that its tangents reach, where it
    is farther than SR.
    """
    centre = params.sensing_range_m + enlarged_radius_m
    return math.sqrt(centre * centre - enlarged_radius_m * enlarged_radius_m)


def sense_circles(
    position: Point, circles: Iterable[tuple[Point, float]], params: SensorParams
) -> Ranges:
    """Range per sector to the nearest enlarged circle, inf when free; single precision.

    Sector i (from 1) covers [i-1, i) times 2 pi / n, counter-clockwise from +x. A sector is
    set when the tangent span of a circle in range touches it. circles holds (centre,
    enlarged radius) in metres. The ranges are rounded to the float32 of a LaserScan message, so
    that decisions are the same with and without messages. Fig. 4, 5.
    Raises InputError for a position or circle that is not finite: NaN must not count as free.
    """
    ranges = [math.inf] * params.sectors
    px, py = position
    reach = params.sensing_range_m
    for (cx, cy), radius in circles:
        dx, dy = cx - px, cy - py
        square, far = dx * dx + dy * dy, (radius + reach) * FARTHER
        if far * far < square < math.inf:
            continue  # surely out of range, as most are: saves the square root
        d = math.sqrt(square)
        if not math.isfinite(d - radius):
            raise InputError(
                f"position {position} and circle {(cx, cy)} of radius {radius}: "
                "not finite; send finite numbers"
            )
        if d - radius <= reach:
            mark_sectors(ranges, d, radius, math.atan2(dy, dx))
    return single_precision(ranges)


def enlarged_radii(count: int, radii_m: Sequence[float], robot_radius_m: float) -> list[float]:
    """The radii of `count` obstacles enlarged by the robot; a single radius holds for all.

    Raises InputError unless there is one or one per obstacle.
    """
    radii = list(radii_m) * count if len(radii_m) == 1 else radii_m
    if len(radii) != count:
        raise InputError(f"{count} obstacles but {len(radii)} obstacle_radii_m; give one each")
    return [r + robot_radius_m for r in radii]


def single_precision(ranges: Sequence[float]) -> Ranges:
    """Round to float32 and back, as a message does."""
    if ranges.count(math.inf) == len(ranges):
        return tuple(ranges)  # the usual case: nothing to round
    return tuple(np.asarray(ranges, dtype=np.float32).tolist())


def mark_sectors(ranges: list[float], d: float, radius: float, direction: float) -> None:
    """Lower the range of every sector that the tangent span of one circle touches."""
    n = len(ranges)
    width = TWO_PI / n
    half = tangent_half_angle(d, radius)
    first = math.floor((direction - half) / width)
    last = math.floor((direction + half) / width)
    for sector in range(first, last + 1):
        nearest = min(max(direction, sector * width), (sector + 1) * width)
        r = ray_circle_distance(d, radius, nearest - direction)
        if not math.isfinite(r):  # a tangent: rounding put it just outside the circle
            r = math.sqrt(d * d - radius * radius)
        index = sector % n
        if r < ranges[index]:
            ranges[index] = r


def bits_text(bits: Bits) -> str:
    """Bits as text, sector 1 first: '110000111000'."""
    return "".join(map(str, bits))
