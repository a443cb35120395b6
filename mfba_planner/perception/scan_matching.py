# SPDX-License-Identifier: Apache-2.0
"""Error of a scan's pose against the local map: point-to-line scan matching with a prior.

The map stands, so whatever moves all returns of a scan alike is an error of the odometry. The
prior's variances are learnt, and with an odometry that does not err the error found is nearly 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..core.geometry import Point
from .scan_surfaces import Surfaces

Array = np.ndarray
Error = tuple[float, float, float]
Nearest = Callable[[Array, Array, Array, Array, int], tuple[Array, Array, Array]]

_MOST = 120  # returns that are matched
_FEWEST = 15
_ANCHORS, _ANCHOR_M = 3, 0.5  # surfaces that must agree; each 0.5 m of a wide one counts
_LEARNING_SCANS = 10  # at the start any error is looked for
_ENOUGH = 200.0  # returns that count in full: errors of neighbours are alike
_LEARNING, _MEAN_SHARE = 0.1, 0.05
_LEVER_M = 2.0  # at which a turn counts as a shift
_HELPS = 0.5  # share of the squared errors that the tracker's estimate must leave, at most
_LEAST_SD, _MOST_SD, _FIRST_SD = 1e-3, 0.06, 0.005  # m and rad
_LEAST_NOISE, _MOST_NOISE, _FIRST_NOISE = 0.003, 0.05, 0.01  # m
_QUIET_SD = 4e-3  # below it one pass is enough
_FAR_M = 3.0
_CLOSE_M = 1e-3  # a step so short is the last
_SOFT_SD, _SOFT_M = 2.0, 0.025  # distance from its line at which a return counts a quarter
_MOST_REACH, _PASSES = 3, 4  # cells


class ScanMatching:
    """The error (x, y, turn) of the present pose, relative to the map, and its variances.

    Measured points = true points + (x, y) + turn around the robot, as in pose_error.py.
    """

    def __init__(self, cell_m: float) -> None:
        """Start without an error."""
        self._cell_m = cell_m
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt."""
        self.error = (0.0, 0.0, 0.0)
        self.sd_m = self.sd_rad = _FIRST_SD  # of what is left of the error
        self.noise_m = _FIRST_NOISE  # of a return
        self._mean = self._expected = (0.0, 0.0, 0.0)
        self._variance_m2 = self._variance_rad2 = _FIRST_SD**2
        self._scans = 0
        self._tracked = (0.0, 0.0, 0.0)
        self._squares = [0.0, 0.0]  # of the errors, and of what the tracker leaves of them
        self._believes = False

    @property
    def variance(self) -> tuple[float, float]:
        """Variances of single poses, per axis (m^2) and of the heading (rad^2); inf: unknown."""
        if self._scans < _LEARNING_SCANS:
            return math.inf, math.inf
        return self._variance_m2, self._variance_rad2

    def estimate(
        self, found: Surfaces, still: Array, origin: Point, nearest: Nearest, expected: Error
    ) -> None:
        """Find the error from the returns with the indices still (k,); k may be 0.

        expected is what else is known of it, less its mean; the tracker's estimate.
        nearest(x, y, nx, ny, cells) gives the x and y of the map's nearest points and the
        distances from positions (k,) with these normals.
        """
        still = still[:: max(1, math.ceil(still.size / _MOST))]
        x, y = found.x[still] - origin[0], found.y[still] - origin[1]
        nx, ny, segment = found.nx[still], found.ny[still], found.segment[still]
        self._tracked = expected
        self._expected = self._mean
        if self._believes:
            (mx, my, mt), (ex, ey, et) = self._mean, expected
            self._expected = (mx + ex, my + ey, mt + et)
        self.error = self._expected
        vm, vr = self._variance_m2, self._variance_rad2
        wide = math.sqrt(vm) + _FAR_M * math.sqrt(vr)
        reach = min(max(math.ceil(2.0 * wide / self._cell_m), 1), _MOST_REACH)
        passes = 1 if max(vm, vr) < _QUIET_SD**2 else _PASSES
        if self._scans < _LEARNING_SCANS:
            reach, passes = _MOST_REACH, _PASSES
        left: Error | None = None
        rest = np.empty(0)
        for k in range(passes):
            before = self.error
            step = self._step(x, y, nx, ny, origin, nearest, max(reach - k, 1))
            if step is None:
                left = None
                break
            left, rest, near = step
            dx, dy, dturn = (e - b for e, b in zip(self.error, before))
            if k >= max(reach - 1, 1) and max(abs(dx), abs(dy), _FAR_M * abs(dturn)) < _CLOSE_M:
                break
        if left is None or _anchors(found, segment[near]) < _ANCHORS:
            self.sd_m, self.sd_rad = math.sqrt(vm), math.sqrt(vr)
            self.error = self._expected
            return
        self.sd_m = math.sqrt(0.5 * (left[0] + left[1]))
        self.sd_rad = math.sqrt(left[2])
        self._learn(left, rest)

    def _step(
        self, x: Array, y: Array, nx: Array, ny: Array, origin: Point,
        nearest: Nearest, reach: int,
    ) -> tuple[Error, Array, Array] | None:  # fmt: skip
        """One Gauss-Newton step; the variances left, distances from lines, and whose they are."""
        ex, ey, turn = self.error
        c, s = math.cos(turn), math.sin(turn)
        rx, ry = c * x + s * y, c * y - s * x
        nx, ny = c * nx + s * ny, c * ny - s * nx
        zx, zy = rx + (origin[0] - ex), ry + (origin[1] - ey)
        qx, qy, d = nearest(zx, zy, nx, ny, reach)
        near = np.flatnonzero(d <= reach * self._cell_m)
        if near.size < _FEWEST:
            return None
        nx, ny, rx, ry = nx[near], ny[near], rx[near], ry[near]
        rest = nx * (zx[near] - qx[near]) + ny * (zy[near] - qy[near])
        soft = max(_SOFT_SD * self.noise_m, _SOFT_M if reach == 1 else reach * self._cell_m)
        w = rest / soft
        w = 1.0 / (1.0 + w * w)
        w *= w
        w *= min(1.0, _ENOUGH / near.size) / (self.noise_m * self.noise_m)
        lever = nx * ry - ny * rx
        wx, wy, wr = w * nx, w * ny, w * lever
        rows = np.array(
            (wx * nx, wx * ny, -wx * lever, wy * ny, -wy * lever, wr * lever,
             wx * rest, wy * rest, -wr * rest)
        )  # fmt: skip
        # accumulate adds in order on every machine
        total = np.add.accumulate(rows, axis=1)[:, -1].tolist()
        xx, xy, xr, yy, yr, rr, bx, by, br = total
        im, ir = 1.0 / self._variance_m2, 1.0 / self._variance_rad2
        mx, my, mt = self._expected
        xx, yy, rr = xx + im, yy + im, rr + ir
        a, b, c = yy * rr - yr * yr, xr * yr - xy * rr, xy * yr - xr * yy
        d, e, f = xx * rr - xr * xr, xy * xr - xx * yr, xx * yy - xy * xy
        scale = 1.0 / (xx * a + xy * b + xr * c)
        a, b, c, d, e, f = (scale * value for value in (a, b, c, d, e, f))
        bx, by, br = bx + im * (mx - ex), by + im * (my - ey), br + ir * (mt - turn)
        self.error = (
            ex + a * bx + b * by + c * br,
            ey + b * bx + d * by + e * br,
            turn + c * bx + e * by + f * br,
        )
        return (a, d, f), rest, near

    def _learn(self, left: Error, rest: Array) -> None:
        self._scans += 1
        self._compare()
        gain = max(_LEARNING, 1.0 / (1.0 + self._scans))
        ex, ey, turn = (e - m for e, m in zip(self.error, self._expected))
        second = 0.5 * (ex * ex + ey * ey + left[0] + left[1])
        vm = self._variance_m2 + gain * (second - self._variance_m2)
        vr = self._variance_rad2
        vr += gain * (turn * turn + left[2] - vr)
        self._variance_m2, self._variance_rad2 = _limited(vm), _limited(vr)
        mx, my, mt = (m + _MEAN_SHARE * (e - m) for e, m in zip(self.error, self._mean))
        self._mean = (mx, my, mt)
        sample = 1.48 * float(np.sort(np.abs(rest))[rest.size // 2])
        noise = self.noise_m + _LEARNING * (sample - self.noise_m)
        self.noise_m = min(max(noise, _LEAST_NOISE), _MOST_NOISE)

    def _compare(self) -> None:
        """Learn whether the tracker's estimate is nearer to the error than its mean."""
        whole = [e - m for e, m in zip(self.error, self._mean)]
        rest = [e - t for e, t in zip(whole, self._tracked)]
        for k, (x, y, turn) in enumerate((whole, rest)):
            square = x * x + y * y + (_LEVER_M * turn) ** 2
            self._squares[k] += _LEARNING * (square - self._squares[k])
        whole2, rest2 = self._squares
        self._believes = rest2 < (_HELPS if not self._believes else 1.0) * whole2

    def corrected(self, x: Array, y: Array, origin: Point) -> tuple[Array, Array]:
        """Points of odom, as the present pose has them, in the map's frame."""
        ex, ey, turn = self.error
        c, s = math.cos(turn), math.sin(turn)
        dx, dy = x - origin[0], y - origin[1]
        return c * dx + s * dy + (origin[0] - ex), c * dy - s * dx + (origin[1] - ey)

    def measured(self, x: Array, y: Array, origin: Point) -> tuple[Array, Array]:
        """Points of the map's frame in odom, as the present pose has it."""
        ex, ey, turn = self.error
        c, s = math.cos(turn), math.sin(turn)
        dx, dy = x - (origin[0] - ex), y - (origin[1] - ey)
        return c * dx - s * dy + origin[0], c * dy + s * dx + origin[1]


def _anchors(found: Surfaces, segment: Array) -> float:
    """Surfaces with a matched return, the wide ones by their width."""
    met = np.bincount(segment) > 0
    return float(np.maximum(found.width_m[: met.size][met] / _ANCHOR_M, 1.0).sum())


def _limited(variance: float) -> float:
    return min(max(variance, _LEAST_SD**2), _MOST_SD**2)
