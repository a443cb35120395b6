# SPDX-License-Identifier: Apache-2.0
"""One scan around the robot's centre, of the scans of several lidars on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core.geometry import Pose2D, distance, rotated
from ..core.planner_types import Scan
from .near_returns import near_at_contact
from .scan_coverage import TWO_PI, covered_sectors, usable_beams

Array = np.ndarray

_JOIN_M, _JOIN_SPACINGS = 0.15, 2.5  # between neighbouring returns of one surface
_LEAST_RANGE_M, _MOST_RANGE_M = 1e-3, 1e3  # some drivers send a range_max of inf
_MOST_BEAMS = 7200
AT_REST = Pose2D(0.0, 0.0)


class PlacedScan(NamedTuple):
    """A scan in the robot's frame at its stamp, and how the robot has moved since.

    robot: its pose at the stamp, seen from its pose at that of the merged scan. velocity (vx, vy,
    wz) in its own frame counts where the scan takes time.
    """

    scan: Scan
    robot: Pose2D = AT_REST
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


def merged_scan(parts: Sequence[PlacedScan], robot_radius_m: float) -> Scan:
    """What all lidars see, as beams from the robot's centre, in the robot's frame.

    Each return keeps its place; of several in one direction the nearest counts. The beams are as
    far apart as those of the coarsest lidar. A direction is free as far as a lidar has covered it
    (scan_coverage.py) and met nothing; it tells nothing (NaN) where no lidar has covered it, and
    in the shadow of an obstacle from where the lidar is. The range is that to which all lidars
    see. -inf is taken at range_min, or at the robot's edge if that is nearer (near_returns.py).
    """
    spacing = max((abs(p.scan.angle_increment_rad) for p in parts), default=0.0) or TWO_PI
    beams = _Beams(round(min(max(TWO_PI / spacing, 1.0), _MOST_BEAMS)))
    reach_m = [p.scan.range_max_m - distance(_placed(p).origin_m, (0.0, 0.0)) for p in parts]
    beams.range_max_m = min(max(min(reach_m), _LEAST_RANGE_M), _MOST_RANGE_M)
    for part in parts:
        beams.add(part, robot_radius_m)
    return beams.scan()


def _placed(part: PlacedScan) -> Scan:
    """The scan in the frame of the merged one; of one that takes time its first beam."""
    x, y = rotated(part.scan.origin_m, part.robot.yaw)
    return replace(
        part.scan,
        angle_min_rad=part.scan.angle_min_rad + part.robot.yaw,
        origin_m=(part.robot.x + x, part.robot.y + y),
    )


class _Beams:
    """The beams of the merged scan in the making."""

    def __init__(self, count: int) -> None:
        self.range_max_m = 0.0
        self._count, self._step = count, TWO_PI / count
        self._bearings = self._step * np.arange(count)
        self._nearest = np.full(count, np.inf)
        self._between = np.full(count, np.inf)  # nearest surfaces between returns
        self._is_free = np.zeros(count, dtype=bool)

    def scan(self) -> Scan:
        nothing = np.where(self._is_free, np.inf, np.nan)
        # A return is better than what lies between two others, unless that hides it.
        hidden = self._between < self._nearest - _JOIN_M
        nearest = np.where(hidden, self._between, self._nearest)
        self._bearings[hidden] = (self._step * np.arange(self._count))[hidden]
        return Scan(
            ranges_m=np.where(np.isinf(nearest), nothing, nearest),
            angle_min_rad=0.0,
            angle_increment_rad=self._step,
            range_min_m=0.0,
            range_max_m=self.range_max_m,
            bearings_rad=self._bearings,
        )

    def add(self, part: PlacedScan, robot_radius_m: float) -> None:
        part = part._replace(scan=near_at_contact(part.scan, robot_radius_m))
        placed, known = _placed(part), usable_beams(part.scan)
        number = np.flatnonzero(known)
        r = np.asarray(placed.ranges_m, dtype=np.float64)[number]
        free = np.isposinf(r)
        length = np.maximum(np.where(free, placed.range_max_m, r), placed.range_min_m)
        length = np.minimum(length, 2.0 * _MOST_RANGE_M)
        x, y = _ends(part, placed, number, length)
        index, bearing = self._index(x, y)
        away = np.sqrt(x * x + y * y)
        free |= away > self.range_max_m
        is_free = np.zeros(self._count, dtype=bool)
        is_free[index[free]] = True
        for k in np.flatnonzero(~free).tolist():
            beam = int(index[k])
            if away[k] < self._nearest[beam]:
                self._nearest[beam], self._bearings[beam] = away[k], bearing[k]
        for a, b, between in self._gaps(placed, number, index):
            if free[a] and free[b]:
                is_free[between] = True
            elif not (free[a] or free[b]) and _are_joined(placed, x, y, length, a, b):
                for beam in between.tolist():
                    self._met_between(beam, (x[a], y[a]), (x[b], y[b]))
        is_free &= covered_sectors(placed, known, self._count, -0.5 * self._step)
        self._is_free |= is_free

    def _index(self, x: Array, y: Array) -> tuple[Array, Array]:
        """The beams nearest to points (k,), and the directions there, at most half a beam off."""
        bearing = np.array([math.atan2(b, a) for a, b in zip(x.tolist(), y.tolist())])
        turned = np.where(bearing < -0.5 * self._step, bearing + TWO_PI, bearing)
        number = np.floor(turned / self._step + 0.5).astype(np.int64)
        off = turned - number * self._step
        number %= self._count
        return number, number * self._step + off

    def _met_between(self, beam: int, a: tuple[float, float], b: tuple[float, float]) -> None:
        """A surface where a beam meets the line through two points."""
        bearing = beam * self._step
        c, s = math.cos(bearing), math.sin(bearing)
        across = c * (b[1] - a[1]) - s * (b[0] - a[0])
        away_m = (a[0] * b[1] - a[1] * b[0]) / across if across else 0.0
        if 0.0 < away_m <= self.range_max_m:
            self._between[beam] = min(away_m, self._between[beam])

    def _gaps(self, scan: Scan, number: Array, index: Array) -> Iterator[tuple[int, int, Array]]:
        """Neighbouring beams of a lidar between which there are merged beams, and these."""
        count, n = self._count, len(scan.ranges_m)
        after = np.roll(np.arange(number.size), -1)
        apart = (number[after] - number) % n
        apart[-1:] += n * (abs(scan.angle_increment_rad) * (n + 0.5) < TWO_PI)  # no full turn
        steps = (index[after] - index + count // 2) % count - count // 2
        wide = (np.abs(steps) > 1) & (np.abs(steps) < count // 4) & (apart == 1)
        for k in np.flatnonzero(wide).tolist():
            sign = 1 if steps[k] > 0 else -1
            between = (index[k] + sign * np.arange(1, abs(int(steps[k])))) % count
            yield k, int(after[k]), between


def _ends(part: PlacedScan, placed: Scan, number: Array, length: Array) -> tuple[Array, Array]:
    """Where beams (k,) of these lengths end, in the frame of the merged scan."""
    angles = placed.angles_rad(number)
    ox, oy = (np.full(number.size, value) for value in placed.origin_m)
    if part.scan.time_increment_s:
        time_s = number * part.scan.time_increment_s
        vx, vy = rotated((part.velocity[0], part.velocity[1]), part.robot.yaw)
        turned = part.velocity[2] * time_s
        angles = angles + turned
        # The lidar turns around the robot's centre as well.
        lx, ly = ox - part.robot.x, oy - part.robot.y
        ox = ox + vx * time_s - turned * ly
        oy = oy + vy * time_s + turned * lx
    found = angles.tolist()
    x: Array = ox + length * np.array([math.cos(angle) for angle in found])
    y: Array = oy + length * np.array([math.sin(angle) for angle in found])
    return x, y


def _are_joined(scan: Scan, x: Array, y: Array, length: Array, a: int, b: int) -> bool:
    nearer = min(float(length[a]), float(length[b]))
    limit = max(_JOIN_M, _JOIN_SPACINGS * nearer * abs(scan.angle_increment_rad))
    dx, dy = float(x[b] - x[a]), float(y[b] - y[a])
    return dx * dx + dy * dy <= limit * limit
