# SPDX-License-Identifier: Apache-2.0
"""Beams of a laser scan in the odom frame: what each has seen, and from where."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Pose2D
from ..core.planner_types import Scan
from .scan_coverage import usable_beams

Array = np.ndarray


@dataclass(frozen=True, slots=True)
class Beams:
    """The k usable beams of a scan, by ascending angle.

    range_m is inf where nothing was met, up to longest_m. Beams whose driver tells nothing (NaN,
    out of range) are left out. number is the beam's place in the scan at constant spacing, so
    that neighbours in the arrays may be more than one number apart. turns: the last beam is the
    neighbour of the first.
    """

    origin_x: Array  # (k,) m
    origin_y: Array
    cos: Array  # (k,)
    sin: Array
    range_m: Array  # (k,) m
    time_s: Array  # (k,) after the stamp
    number: Array  # (k,) int
    count: int  # beams of the whole scan
    spacing_rad: float
    angle_min_rad: float
    longest_m: float
    turns: bool

    def index_of(self, bearing_rad: Array) -> Array:
        """Number of the beam nearest to each bearing; outside the scan's angles it is beyond."""
        turn = 2.0 * math.pi
        off = np.remainder(bearing_rad - self.angle_min_rad + 0.5 * self.spacing_rad, turn)
        index: Array = (off / self.spacing_rad).astype(np.int64)
        return index % self.count if self.turns else index


class BeamReader:
    """Converts scans; keeps the directions of the last kind of scan, as they seldom change."""

    def __init__(self) -> None:
        """Start without directions."""
        self._key: tuple[int, float] = (0, 0.0)
        self._cos, self._sin, self._all = np.empty(0), np.empty(0), np.empty(0, dtype=np.int64)
        self._first: float | None = None  # direction of the first beam in odom, of these:
        self._turned = self._cos, self._sin

    def read(self, pose: Pose2D, velocity: tuple[float, float, float], scan: Scan) -> Beams:
        """The beams of a scan in a frame aligned with odom, whose origin is at the pose.

        velocity is the robot's (vx, vy, wz) in odom, for scans that take time: the sensor moves
        on between two beams.
        """
        r = np.asarray(scan.ranges_m, dtype=np.float64)
        count, step = r.size, scan.angle_increment_rad
        if (count, step) != self._key:
            angles = [k * step for k in range(count)]
            self._cos = np.array([math.cos(a) for a in angles])
            self._sin = np.array([math.sin(a) for a in angles])
            self._all = np.arange(count)
            self._key, self._first = (count, step), None
        if scan.angle_min_rad != self._first:  # a robot that does not turn keeps it
            self._first = scan.angle_min_rad
            c0, s0 = math.cos(self._first), math.sin(self._first)
            self._turned = c0 * self._cos - s0 * self._sin, s0 * self._cos + c0 * self._sin
        number, (c, s) = self._all, self._turned
        if scan.bearings_rad is not None:
            angles = scan.angles_rad(number).tolist()
            c = np.array([math.cos(angle) for angle in angles])
            s = np.array([math.sin(angle) for angle in angles])
        usable = usable_beams(scan)
        if not usable.all():
            number = usable.nonzero()[0]
            r, c, s = r[number], c[number], s[number]
        reach = np.maximum(r, scan.range_min_m)  # -inf is nearer than that
        k = number.size
        x: Array = np.full(k, pose.x)
        y: Array = np.full(k, pose.y)
        time_s: Array = np.zeros(k)
        if scan.time_increment_s:
            time_s = number * scan.time_increment_s
            vx, vy, wz = velocity
            turned = wz * time_s
            ct, st = 1.0 - 0.5 * turned * turned, turned * (1.0 - turned * turned / 6.0)
            c, s = ct * c - st * s, st * c + ct * s
            x, y = x + vx * time_s, y + vy * time_s
        angle_min = scan.angle_min_rad
        if step < 0.0:
            angle_min += step * (count - 1)
            number = count - 1 - number
            x, y, c, s = x[::-1], y[::-1], c[::-1], s[::-1]
            reach, time_s, number = reach[::-1], time_s[::-1], number[::-1]
        spacing = abs(step) or 2.0 * math.pi
        return Beams(
            origin_x=x,
            origin_y=y,
            cos=c,
            sin=s,
            range_m=reach,
            time_s=time_s,
            number=number,
            count=count,
            spacing_rad=spacing,
            angle_min_rad=angle_min,
            longest_m=scan.range_max_m,
            turns=count > 1 and spacing * count > 2.0 * math.pi - 0.5 * spacing,
        )


def clear_lengths(beams: Beams, bearing: Array, turn_sd: float) -> tuple[Array, Array]:
    """Least free length of the beams at and beside each bearing; angle to the nearest beam.

    0 where one of them tells nothing.
    """
    clear = np.zeros(beams.count)
    clear[beams.number] = np.minimum(beams.range_m, beams.longest_m)
    beside = 1 + math.floor(2.0 * turn_sd / beams.spacing_rad)
    least = clear.copy()
    for k in range(1, beside + 1):
        np.minimum(least[k:], clear[:-k], out=least[k:])
        np.minimum(least[:-k], clear[k:], out=least[:-k])
        if beams.turns:
            np.minimum(least[:k], clear[-k:], out=least[:k])
            np.minimum(least[-k:], clear[:k], out=least[-k:])
    if not beams.turns:
        least[:beside] = least[least.size - beside :] = 0.0
    number = beams.index_of(bearing)
    inside = (number >= 0) & (number < beams.count)
    number[~inside] = 0
    off = np.remainder(bearing - beams.angle_min_rad - number * beams.spacing_rad, 2.0 * math.pi)
    off = np.minimum(off, 2.0 * math.pi - off)
    return np.where(inside, least[number], 0.0), off
