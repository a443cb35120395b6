# SPDX-License-Identifier: Apache-2.0
"""Independent check of a robot of several circles: shares no formula with simulation's contact.

The distance of a circle changes at most as fast as it moves, so between two moments it is above a
bound; intervals that may hold less than what was found are halved. Simulation cuts curves into
chords and uses closed forms.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from ...simulation.scenario import Scenario
from .path_check import pieces

TOLERANCE_M = 1e-5


class TimedPose(NamedTuple):
    """A time (s) and the robot's pose then: x, y (m), yaw (rad)."""

    t_s: float
    x: float
    y: float
    yaw: float


class _Interval(NamedTuple):
    """A distance (m) as a function of time in [start_s, end_s]; it changes by at most rate_mps."""

    distance_m: Callable[[float], float]
    start_s: float
    end_s: float
    rate_mps: float


def footprint_clearance(
    scenario: Scenario, poses: Sequence[TimedPose], tolerance_m: float = TOLERANCE_M
) -> float:
    """Smallest gap (m) between the footprint and any obstacle or wall; < 0: contact.

    base_link moves uniformly between two poses, and the yaw turns uniformly by the shorter turn.
    The gap is that of a moment: at most tolerance_m above the smallest, and never below it.
    """
    smallest = math.inf
    for circle in scenario.robot.footprint_m:
        for a, b in pairwise(poses):
            for radius_m, interval in _intervals(scenario, complex(circle.x, circle.y), a, b):
                edges_m = circle.radius + radius_m
                least = _least(interval, smallest + edges_m, tolerance_m)
                smallest = min(smallest, least - edges_m)
    return smallest


def _intervals(
    scenario: Scenario, offset: complex, a: TimedPose, b: TimedPose
) -> Iterator[tuple[float, _Interval]]:
    """Of the step from a to b of a point of the robot: each obstacle's radius, and the distance.

    The plane is that of complex numbers.
    """
    duration_s = b.t_s - a.t_s
    if duration_s <= 0.0:
        return
    velocity = complex(b.x - a.x, b.y - a.y) / duration_s
    turn_radps = math.remainder(b.yaw - a.yaw, 2.0 * math.pi) / duration_s
    swing_mps = abs(offset) * abs(turn_radps)

    def place(t_s: float) -> complex:
        since_s = t_s - a.t_s
        turned = cmath.rect(1.0, a.yaw + turn_radps * since_s)
        return complex(a.x, a.y) + velocity * since_s + offset * turned

    for obstacle in scenario.obstacles:
        for since_s, until_s, x, y, vx, vy in pieces(obstacle, scenario.walls, b.t_s):
            start_s, end_s = max(since_s, a.t_s), min(until_s, b.t_s)
            if start_s > end_s:
                continue

            def to_obstacle(
                t_s: float,
                at: complex = complex(x, y),
                moves: complex = complex(vx, vy),
                since_s: float = since_s,
            ) -> float:
                return abs(place(t_s) - at - moves * (t_s - since_s))

            rate_mps = abs(velocity - complex(vx, vy)) + swing_mps
            yield obstacle.radius_m, _Interval(to_obstacle, start_s, end_s, rate_mps)
    for x0, y0, x1, y1 in scenario.segments_m:
        wall = complex(x1 - x0, y1 - y0)

        def to_wall(
            t_s: float, at: complex = complex(x0, y0), along: complex = wall / abs(wall),
            length: float = abs(wall),
        ) -> float:  # fmt: skip
            from_wall = (place(t_s) - at) / along  # it lies on the real axis from 0 on
            beyond = max(-from_wall.real, from_wall.real - length, 0.0)
            return math.hypot(beyond, from_wall.imag)

        yield 0.0, _Interval(to_wall, a.t_s, b.t_s, abs(velocity) + swing_mps)


def _least(interval: _Interval, known_m: float, tolerance_m: float) -> float:
    """The smallest distance found, or known_m where it is not smaller by more than tolerance_m."""
    distance_m = interval.distance_m
    ends = (interval.start_s, interval.end_s)
    waiting = [(*ends, distance_m(ends[0]), distance_m(ends[1]))]
    least = min(known_m, *waiting[0][2:])
    while waiting:
        start_s, end_s, first_m, last_m = waiting.pop()
        bound_m = 0.5 * (first_m + last_m - interval.rate_mps * (end_s - start_s))
        middle_s = 0.5 * (start_s + end_s)
        if bound_m >= least - tolerance_m or not start_s < middle_s < end_s:
            continue
        middle_m = distance_m(middle_s)
        least = min(least, middle_m)
        halves = [(start_s, middle_s, first_m, middle_m), (middle_s, end_s, middle_m, last_m)]
        halves.sort(key=lambda half: half[2] + half[3], reverse=True)  # the nearer one first
        waiting += halves
    return least
