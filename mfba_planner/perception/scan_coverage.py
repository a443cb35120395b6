# SPDX-License-Identifier: Apache-2.0
"""Which directions a lidar has covered in the last moments: what is not seen is not free."""

from __future__ import annotations

import math

import numpy as np

from ..core.planner_types import NANO, Scan

TWO_PI = 2.0 * math.pi
WIDEST_BEAM_RAD = math.radians(31.0)  # of 12 beams; fewer beams leave directions between them


def usable_beams(scan: Scan) -> np.ndarray:
    """Whether each beam tells what is in its direction, (n,): a return, or free space (REP-117).

    NaN and finite values outside [range_min, range_max] tell nothing.
    """
    r = scan.ranges_m
    known: np.ndarray = np.isinf(r) | ((r >= scan.range_min_m) & (r <= scan.range_max_m))
    return known


class ScanCoverage:
    """The stamp at which each of n equal headings was last covered by a usable beam.

    A beam covers half the angle to its neighbours, at most half of WIDEST_BEAM_RAD.
    """

    def __init__(self, headings: int, memory_s: float) -> None:
        """Nothing is covered; heading k (from 1) is k 2 pi / n, counter-clockwise from +x."""
        self._n, self._memory_ns = headings, round(memory_s / NANO)
        self._last_ns: np.ndarray | None = None
        self._complete_ns = -1

    def update(self, stamp_ns: int, scan: Scan) -> None:
        """Add a scan in a frame aligned with that of the headings."""
        known, step = usable_beams(scan), abs(scan.angle_increment_rad)
        if known.all() and step <= WIDEST_BEAM_RAD and step * (known.size + 0.5) >= TWO_PI:
            self._complete_ns = stamp_ns  # the usual case
            return
        if self._last_ns is None:
            self._last_ns = np.full(self._n, -1, dtype=np.int64)
        half = 0.5 * min(step, WIDEST_BEAM_RAD)
        beams = np.flatnonzero(known)
        angles = scan.angle_min_rad + scan.angle_increment_rad * beams
        width = TWO_PI / self._n
        for offset in np.linspace(-half, half, 1 + math.ceil(2.0 * half / width)):
            headings = np.round((angles + offset) / width).astype(np.int64) - 1
            self._last_ns[headings % self._n] = stamp_ns

    def uncovered(self, now_ns: int) -> np.ndarray | None:
        """Whether each heading was not covered within the memory, (n,); None if all were."""
        if self._complete_ns >= max(now_ns - self._memory_ns, 0):
            return None
        if self._last_ns is None:
            return np.ones(self._n, dtype=bool)
        missing: np.ndarray = self._last_ns < max(now_ns - self._memory_ns, 0)
        return missing if missing.any() else None
