# SPDX-License-Identifier: Apache-2.0
"""The odometry's error of one scan, from what all tracks have in common.

An odometry that errs moves all obstacles of a scan alike; obstacles that move do not. The error
(x, y, turn) is estimated by least squares from the differences between measured and predicted
centres, with a prior of variances that are learnt from the errors of the scans before.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point

Array = np.ndarray
Covariance = tuple[float, float, float, float, float, float]  # xx, xy, xr, yy, yr, rr

_LEARNING = 0.1  # weight of one scan in the variances
_LEAST_SD, _MOST_SD = 1e-3, 0.06  # m and rad
_FIRST_SD = 0.02
_MEDIAN = 1.386  # of a chi-squared variable of two degrees of freedom
_SHRINKS = 0.7  # most change of a variance by one scan
_PASSES = 3
_MEAN_SHARE = 0.15
_ENOUGH = 3  # tracks that tell an error of the odometry from motion
_OUTLIER = 9.0  # squared Mahalanobis distance


class PoseError:
    """The error of the present scan's pose and the variances of such errors."""

    def __init__(self) -> None:
        """Start with small variances and no error."""
        self.variance_m2 = _FIRST_SD**2
        self.variance_rad2 = _FIRST_SD**2
        self.error = (0.0, 0.0, 0.0)
        self._mean = (0.0, 0.0, 0.0)  # of the last errors

    def follow(self, share: float) -> tuple[float, float, float]:
        """Take that share off the error, as the tracks move towards the odometry by it."""
        x, y, turn = (share * value for value in self.error)
        self.error = (self.error[0] - x, self.error[1] - y, self.error[2] - turn)
        return x, y, turn

    @property
    def sd_m(self) -> float:
        """Standard deviation of the position, per axis."""
        return math.sqrt(self.variance_m2)

    @property
    def sd_rad(self) -> float:
        """Standard deviation of the heading."""
        return math.sqrt(self.variance_rad2)

    def shift(self, x: Array, y: Array, origin: Point) -> tuple[Array, Array]:
        """How far the present error has moved measured points."""
        ex, ey, turn = self.error
        return ex - turn * (y - origin[1]), ey + turn * (x - origin[0])

    @staticmethod
    def noise(measured: Array, left: Covariance, origin: Point) -> Array:
        """Covariances (3, 3, j) of (x, y, r) at centres (2, j) by what is left of the error."""
        px, py = origin[1] - measured[1], measured[0] - origin[0]
        xx, xy, xr, yy, yr, rr = left
        noise = np.zeros((3, 3, measured.shape[1]))
        noise[0, 0] = xx + px * (2.0 * xr + rr * px)
        noise[1, 1] = yy + py * (2.0 * yr + rr * py)
        noise[0, 1] = noise[1, 0] = xy + px * yr + py * (xr + rr * px)
        return noise

    def estimate(
        self, measured: Array, predicted: Array, covariance: Array, settled: Array, origin: Point
    ) -> Covariance:
        """Estimate the error from centres (2, j) and their covariances (2, 2, j).

        Outliers are left out. If fewer than three or fewer than half of the tracks agree, the
        error stays 0: one or two that move look like an odometry that errs. The variances are
        learnt from settled tracks (j,) only. Returns the covariance that is left.
        """
        self.error = (0.0, 0.0, 0.0)
        vm, vr = self.variance_m2, self.variance_rad2
        left = (vm, 0.0, 0.0, vm, 0.0, vr)
        if not settled.size:
            return left
        equations = _Equations(measured, predicted, covariance, origin)
        agree = settled
        if settled.size >= _ENOUGH:
            found = self._solve(equations)
            if found is not None:
                left, agree = found
                agree = agree & settled
        self._learn(equations, agree, left)
        return left

    def _solve(self, equations: _Equations) -> tuple[Covariance, Array] | None:
        """Set the error; what is left of its covariance, and which tracks agree (j,)."""
        vm, vr = self.variance_m2, self.variance_rad2
        fits = equations.length(vm, vr) < _OUTLIER
        left, error = equations.solution(vm, vr, fits)
        near = equations.rest(error)
        for _ in range(_PASSES):
            if not (fits & (near > _OUTLIER)).any():
                break
            # Some contradict: weigh all by their distance from the solution.
            left, error = equations.solution(vm, vr, fits / (1.0 + near / 3.0))
            near = equations.rest(error)
        agree = near <= _OUTLIER
        count = int(np.count_nonzero(agree))
        if count < _ENOUGH or 2 * count < agree.size:
            return None
        if count < agree.size:
            left, error = equations.solution(vm, vr, agree)
        self.error = error
        return left, agree

    def _learn(self, equations: _Equations, tracks: Array, left: Covariance) -> None:
        """Learn the variances: their size from the lengths, their ratio from the error.

        Squared Mahalanobis lengths have the median 1.39 where the variances are right. The mean
        of the last errors is left out: an odometry that drifts does not jump.
        """
        count = int(np.count_nonzero(tracks))
        if not count:
            return
        vm, vr = self.variance_m2, self.variance_rad2
        length = np.sort(equations.length(vm, vr, self._mean)[tracks])
        factor = float(length[count // 2]) / _MEDIAN
        factor = min(max(factor, _SHRINKS), 1.0 / _SHRINKS)
        vm, vr = factor * vm, factor * vr
        if self.error != (0.0, 0.0, 0.0):
            ex, ey, turn = (e - m for e, m in zip(self.error, self._mean))
            second = 0.5 * (ex * ex + ey * ey + left[0] + left[3])
            vm += _LEARNING * (second - vm)
            vr += _LEARNING * (turn * turn + left[5] - vr)
        self.variance_m2, self.variance_rad2 = _limited(vm), _limited(vr)
        mx, my, mt = (m + _MEAN_SHARE * (e - m) for e, m in zip(self.error, self._mean))
        self._mean = (mx, my, mt)


def _limited(variance: float) -> float:
    return min(max(variance, _LEAST_SD**2), _MOST_SD**2)


class _Equations:
    """The differences of j centres as linear functions of the pose's error."""

    def __init__(
        self, measured: Array, predicted: Array, covariance: Array, origin: Point
    ) -> None:
        self.ex, self.ey = measured - predicted
        self.px, self.py = origin[1] - predicted[1], predicted[0] - origin[0]  # m per rad
        self.xx, self.xy, self.yy = covariance[0, 0], covariance[0, 1], covariance[1, 1]
        scale = 1.0 / (self.xx * self.yy - self.xy * self.xy)
        ixx, ixy, iyy = scale * self.yy, -scale * self.xy, scale * self.xx
        self.ixx, self.ixy, self.iyy = ixx, ixy, iyy
        gx, gy = ixx * self.ex + ixy * self.ey, ixy * self.ex + iyy * self.ey
        rx, ry = ixx * self.px + ixy * self.py, ixy * self.px + iyy * self.py
        self.rows = np.array(
            (ixx, ixy, rx, iyy, ry, self.px * rx + self.py * ry, gx, gy,
             self.px * gx + self.py * gy)
        )  # fmt: skip

    def length(
        self, vm: float, vr: float, mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> Array:
        """Squared Mahalanobis lengths (j,) of the differences before the error is known."""
        px, py = self.px, self.py
        ex, ey = self.ex - mean[0] - mean[2] * px, self.ey - mean[1] - mean[2] * py
        xx, yy = self.xx + vm + vr * px * px, self.yy + vm + vr * py * py
        xy = self.xy + vr * px * py
        length: Array = (yy * ex * ex - 2.0 * xy * ex * ey + xx * ey * ey) / (xx * yy - xy * xy)
        return length

    def rest(self, error: tuple[float, float, float]) -> Array:
        """Squared Mahalanobis lengths (j,) of what an error (x, y, turn) does not explain."""
        x, y, turn = error
        ex, ey = self.ex - x - turn * self.px, self.ey - y - turn * self.py
        rest: Array = self.ixx * ex * ex + 2.0 * self.ixy * ex * ey + self.iyy * ey * ey
        return rest

    def solution(
        self, vm: float, vr: float, weight: Array
    ) -> tuple[Covariance, tuple[float, float, float]]:
        """Covariance and error by weighted least squares with the prior variances."""
        # accumulate adds in order on every machine
        total = np.add.accumulate(self.rows * weight, axis=1)[:, -1].tolist()
        xx, xy, xr, yy, yr, rr, bx, by, br = total
        xx, yy, rr = xx + 1.0 / vm, yy + 1.0 / vm, rr + 1.0 / vr
        a, b, c = yy * rr - yr * yr, xr * yr - xy * rr, xy * yr - xr * yy
        d, e, f = xx * rr - xr * xr, xy * xr - xx * yr, xx * yy - xy * xy
        scale = 1.0 / (xx * a + xy * b + xr * c)
        a, b, c, d, e, f = (scale * value for value in (a, b, c, d, e, f))
        error = (a * bx + b * by + c * br, b * bx + d * by + e * br, c * bx + e * by + f * br)
        return (a, b, c, d, e, f), error
