# SPDX-License-Identifier: Apache-2.0
"""The footprint of a robot that is no disc: circles in base_link, checked."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import combinations
from typing import Any, NamedTuple

from ..core.errors import ConfigError
from ..core.geometry import Point, Pose2D, rotated

MOST_CIRCLES = 16
FARTHEST_M = 100.0  # of a centre from base_link on each axis, and the largest radius
_ROUNDING_M, _SAME_M = 1e-7, 1e-12
_REMEDY = "give [x, y, radius] in base_link, m"


class FootprintCircle(NamedTuple):
    """A circle of a footprint: centre x, y in base_link and radius, metres."""

    x: float
    y: float
    radius: float

    @property
    def offset_m(self) -> float:
        """Distance of the centre from base_link."""
        return math.sqrt(self.x * self.x + self.y * self.y)


Footprint = tuple[FootprintCircle, ...]


def parse_footprint(given: Any) -> Footprint:
    """The circles from a list [[x, y, radius], ...]; empty for a disc of robot_radius_m.

    Raises ConfigError: value, reason, remedy.
    """
    if not isinstance(given, list | tuple):
        raise ConfigError(
            f"footprint_m={_shown(given)}: not a list; give circles [[x, y, radius], ...], m"
        )
    if len(given) > MOST_CIRCLES:
        raise ConfigError(
            f"footprint_m: {len(given)} circles, more than {MOST_CIRCLES}; give fewer, larger ones"
        )
    return tuple(_circle(number, entry) for number, entry in enumerate(given, start=1))


def _circle(number: int, entry: Any) -> FootprintCircle:
    what = f"footprint_m circle {number}={_shown(entry)}"
    if not isinstance(entry, list | tuple) or len(entry) != 3:
        raise ConfigError(f"{what}: not three numbers; {_REMEDY}")
    if any(type(value) not in (int, float) for value in entry):
        raise ConfigError(f"{what}: not three numbers; {_REMEDY}")
    if not all(-FARTHEST_M <= value <= FARTHEST_M for value in entry):  # NaN neither
        raise ConfigError(f"{what}: not finite, or beyond {FARTHEST_M:g} m; {_REMEDY}")
    x, y, radius = map(float, entry)
    if radius <= 0.0:
        raise ConfigError(f"{what}: radius {radius:g}; give a radius above 0 m")
    return FootprintCircle(x, y, radius)


def _shown(value: Any) -> str:
    text = str(list(value) if isinstance(value, tuple) else value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def circumscribed_radius_m(footprint: Footprint) -> float:
    """Radius of the smallest disc around base_link that holds all circles: max(offset + r)."""
    return max((circle.offset_m + circle.radius for circle in footprint), default=0.0)


@lru_cache(maxsize=64)
def inscribed_radius_m(footprint: Footprint) -> float:
    """Radius of the largest disc around base_link that the circles cover together.

    The distance to the edge of their union, whose nearest point is that of an arc or a corner, two
    circles' intersection. 0: base_link lies in none of them. Rounding makes it smaller only.
    """
    if not any(circle.offset_m < circle.radius for circle in footprint):
        return 0.0
    points = [point for circle in footprint for point in _nearest(circle)]
    points += [point for pair in combinations(footprint, 2) for point in _intersections(*pair)]
    on_edge = [
        math.hypot(x, y)
        for x, y in points
        if all(math.hypot(x - c.x, y - c.y) >= c.radius - _ROUNDING_M for c in footprint)
    ]
    return max(0.0, min(on_edge, default=0.0) - _ROUNDING_M)


def _nearest(circle: FootprintCircle) -> list[Point]:
    """The point of a circle's edge that is nearest to base_link; if all are, one of them."""
    if circle.offset_m < _SAME_M:
        return [(circle.radius, 0.0)]
    share = 1.0 - circle.radius / circle.offset_m
    return [(share * circle.x, share * circle.y)]


def _intersections(a: FootprintCircle, b: FootprintCircle) -> list[Point]:
    dx, dy = b.x - a.x, b.y - a.y
    square = dx * dx + dy * dy
    if square < _SAME_M * _SAME_M:
        return []
    share = 0.5 * (1.0 + (a.radius * a.radius - b.radius * b.radius) / square)
    beside = a.radius * a.radius / square - share * share
    if beside < -_ROUNDING_M:
        return []
    root = math.sqrt(max(0.0, beside))
    x, y = a.x + share * dx, a.y + share * dy
    return [(x - root * dy, y + root * dx), (x + root * dy, y - root * dx)]


def circles_at(footprint: Footprint, pose: Pose2D) -> list[tuple[Point, float]]:
    """Centres in the odom frame and radii (m) of the circles; NaN for a pose not finite."""
    yaw = pose.yaw if math.isfinite(pose.yaw) else math.nan
    found = []
    for circle in footprint:
        dx, dy = rotated((circle.x, circle.y), yaw)
        found.append(((pose.x + dx, pose.y + dy), circle.radius))
    return found
