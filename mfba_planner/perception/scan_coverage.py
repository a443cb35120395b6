# SPDX-License-Identifier: Apache-2.0
"""Which directions a lidar has covered in the last moments: what is not seen is not free."""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, rotated
from ..core.planner_types import NANO, Scan

TWO_PI = 2.0 * math.pi
WIDEST_BEAM_RAD = math.radians(31.0)  # of 12 beams; fewer beams leave directions between them
BODY_RAD = math.radians(60.0)
NARROW_RAD = math.radians(15.0)
_RING_M = 1.0  # from the robot: there it is judged which directions an offset lidar covers
_WITHIN = 1.0 - 1e-6  # a beam in the middle of a sector does not touch the next one


def usable_beams(scan: Scan) -> np.ndarray:
    """Whether each beam tells what is in its direction, (n,): a return, or free space (REP-117).

    NaN and finite values outside [range_min, range_max] tell nothing.
    """
    r = np.asarray(scan.ranges_m, dtype=np.float64)
    known: np.ndarray = np.isinf(r) | ((r >= scan.range_min_m) & (r <= scan.range_max_m))
    return known


def covers_a_full_turn(scan: Scan, known: np.ndarray) -> bool:
    """Whether the known beams, all of them, leave no direction out: the usual case."""
    step = abs(scan.angle_increment_rad)
    return bool(known.all()) and step <= WIDEST_BEAM_RAD and step * (known.size + 0.5) >= TWO_PI


def covered_sectors(scan: Scan, known: np.ndarray, sectors: int, first_rad: float) -> np.ndarray:
    """Whether a known beam covers part of each of n equal sectors, the first from first_rad; (n,).

    A beam covers half the angle to its neighbours on both sides, at most half of WIDEST_BEAM_RAD.
    Sectors are those around the robot; beams may begin beside it (Scan.origin_m).
    """
    width = TWO_PI / sectors
    half = 0.5 * min(abs(scan.angle_increment_rad), WIDEST_BEAM_RAD) * _WITHIN
    beams = np.flatnonzero(known)
    angles = scan.angle_min_rad + scan.angle_increment_rad * beams - first_rad
    is_beside = scan.origin_m != (0.0, 0.0)
    samples = (1 + is_beside) * math.ceil(2.0 * half / width)  # seen from beside, beams spread
    covered = np.zeros(sectors, dtype=bool)
    for offset in np.linspace(-half, half, 2 + samples):
        directions = angles + offset
        if is_beside:
            directions = _from_robot(directions, rotated(scan.origin_m, -first_rad))
        covered[np.floor(directions / width).astype(np.int64) % sectors] = True
    return covered


def _from_robot(angles: np.ndarray, origin: Point) -> np.ndarray:
    """Directions, from the robot, of where beams (n,) from an origin beside it reach the ring."""
    ox, oy = origin
    square = ox * ox + oy * oy
    ring = max(_RING_M * _RING_M, 4.0 * square)
    found = []
    for angle in angles.tolist():  # math: every machine rounds alike
        c, s = math.cos(angle), math.sin(angle)
        along = ox * c + oy * s
        length = math.sqrt(along * along + ring - square) - along
        found.append(math.atan2(oy + length * s, ox + length * c))
    return np.array(found)


class ScanCoverage:
    """When each of n equal headings was last covered by a beam that tells what is there."""

    def __init__(self, headings: int, memory_s: float) -> None:
        """Nothing is covered; heading k (from 1) is k 2 pi / n, counter-clockwise from +x."""
        self._n, self._memory_ns = headings, round(memory_s / NANO)
        self._last_ns: np.ndarray | None = None
        self._complete_ns = -1

    def update(self, stamp_ns: int, scan: Scan) -> None:
        """Add a scan in a frame aligned with that of the headings."""
        known = usable_beams(scan)
        if covers_a_full_turn(scan, known):
            self._complete_ns = stamp_ns
            return
        if self._last_ns is None:
            self._last_ns = np.full(self._n, -1, dtype=np.int64)
        half_width = math.pi / self._n  # around heading 1
        self._last_ns[covered_sectors(scan, known, self._n, half_width)] = stamp_ns

    def unsafe(self, now_ns: int) -> np.ndarray | None:
        """Whether driving along each heading leads into what is not covered, (n,); None: nowhere.

        The front of the robot's body sweeps all directions within a right angle of the heading.
        Those within BODY_RAD must be covered; beside that, contact is a graze. Directions left out
        that are narrower than NARROW_RAD hide nothing but thin posts: on the robot, mostly.
        """
        missing = self.uncovered(now_ns)
        if missing is None:
            return None
        narrow = round(NARROW_RAD / TWO_PI * self._n)
        wide = np.logical_and.reduce([np.roll(missing, -k) for k in range(narrow + 1)])
        if not wide.any():
            return None
        body = round(BODY_RAD / TWO_PI * self._n)
        shifts = range(-body, narrow + 1 + body)
        closed: np.ndarray = np.logical_or.reduce([np.roll(wide, k) for k in shifts])
        return closed

    def uncovered(self, now_ns: int) -> np.ndarray | None:
        """Whether each heading was not covered within the memory, (n,); None if all were."""
        oldest_ns = max(now_ns - self._memory_ns, 0)
        if self._complete_ns >= oldest_ns:
            return None
        if self._last_ns is None:
            return np.ones(self._n, dtype=bool)
        missing: np.ndarray = self._last_ns < oldest_ns
        return missing if missing.any() else None
