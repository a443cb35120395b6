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
Error = tuple[float, float, float]  # x, y in m, turn in rad
NO_ERROR: Error = (0.0, 0.0, 0.0)

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
        self.learnt = 0  # scans that the variances were learnt from
        self.error = NO_ERROR
        self._mean = (0.0, 0.0, 0.0)  # of the last errors

    def follow(self, share: float) -> Error:
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
        px, py = _lever(measured, origin)
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
        self.error = NO_ERROR
        vm, vr = self.variance_m2, self.variance_rad2
        left = (vm, 0.0, 0.0, vm, 0.0, vr)
        if not settled.size:
            return left
        equations = _Equations(measured, predicted, covariance, origin, vm, vr)
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
        fits = equations.length() < _OUTLIER
        left, error = equations.solution(fits)
        near = equations.rest(error)
        for _ in range(_PASSES):
            if not (fits & (near > _OUTLIER)).any():
                break
            # Some contradict: weigh all by their distance from the solution.
            left, error = equations.solution(fits / (1.0 + near / 3.0))
            near = equations.rest(error)
        agree = near <= _OUTLIER
        count = int(np.count_nonzero(agree))
        if count < _ENOUGH or 2 * count < agree.size:
            return None
        if count < agree.size:
            left, error = equations.solution(agree)
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
        self.learnt += 1
        vm, vr = self.variance_m2, self.variance_rad2
        length = equations.length(self._mean)[tracks]
        length.sort()
        factor = float(length[count // 2]) / _MEDIAN
        factor = min(max(factor, _SHRINKS), 1.0 / _SHRINKS)
        vm, vr = factor * vm, factor * vr
        if self.error != NO_ERROR:
            ex, ey, turn = (e - m for e, m in zip(self.error, self._mean))
            second = 0.5 * (ex * ex + ey * ey + left[0] + left[3])
            vm += _LEARNING * (second - vm)
            vr += _LEARNING * (turn * turn + left[5] - vr)
        self.variance_m2, self.variance_rad2 = _limited(vm), _limited(vr)
        mx, my, mt = (m + _MEAN_SHARE * (e - m) for e, m in zip(self.error, self._mean))
        self._mean = (mx, my, mt)


def _lever(centers: Array, origin: Point) -> Array:
    """How centres (2, j) move by a turn around the origin, m per rad; (2, j)."""
    return np.array((origin[1] - centers[1], centers[0] - origin[0]))


def _limited(variance: float) -> float:
    return min(max(variance, _LEAST_SD**2), _MOST_SD**2)


class _Equations:
    """The differences of j centres as linear functions of the pose's error, and its prior."""

    def __init__(
        self, measured: Array, predicted: Array, covariance: Array, origin: Point,
        vm: float, vr: float,
    ) -> None:  # fmt: skip
        self._prior = vm, vr
        self._e, self._p = e, p = measured - predicted, _lever(predicted, origin)
        xy = covariance[0, 1]
        of_axis = np.array((covariance[0, 0], covariance[1, 1]))
        scale = 1.0 / (of_axis[0] * of_axis[1] - xy * xy)
        inverse, inverse_xy = scale * of_axis[::-1], -scale * xy
        self._inverse = inverse, 2.0 * inverse_xy
        g, r = (inverse * v + inverse_xy * v[::-1] for v in (e, p))
        pg, pr = p * g, p * r
        self._rows = np.array(
            (inverse[0], inverse_xy, r[0], inverse[1], r[1], pr[0] + pr[1], g[0], g[1],
             pg[0] + pg[1])
        )  # fmt: skip
        by_turn = vr * p
        of_axis += vm
        of_axis += by_turn * p
        xy = xy + by_turn[0] * p[1]
        self._adjugate = of_axis[::-1], -2.0 * xy
        self._determinant = of_axis[0] * of_axis[1] - xy * xy

    def length(self, mean: Error = NO_ERROR) -> Array:
        """Squared Mahalanobis lengths (j,) of the differences before the error is known."""
        return self._quadratic(self._adjugate, mean) / self._determinant

    def rest(self, error: Error) -> Array:
        """Squared Mahalanobis lengths (j,) of what an error does not explain."""
        return self._quadratic(self._inverse, error)

    def _quadratic(self, form: tuple[Array, Array], error: Error) -> Array:
        """A quadratic form (j,) of what an error leaves of the differences."""
        e, (of_axis, xy) = self._e, form
        if error != NO_ERROR:
            x, y, turn = error
            e = e - ((x,), (y,)) - turn * self._p
        squares = of_axis * e
        squares *= e
        total: Array = squares[0] + xy * e[0] * e[1] + squares[1]
        return total

    def solution(self, weight: Array) -> tuple[Covariance, Error]:
        """Covariance and error by weighted least squares with the prior variances."""
        # accumulate adds in order on every machine
        total = np.add.accumulate(self._rows * weight, axis=1)[:, -1].tolist()
        xx, xy, xr, yy, yr, rr, bx, by, br = total
        vm, vr = self._prior
        xx, yy, rr = xx + 1.0 / vm, yy + 1.0 / vm, rr + 1.0 / vr
        a, b, c = yy * rr - yr * yr, xr * yr - xy * rr, xy * yr - xr * yy
        d, e, f = xx * rr - xr * xr, xy * xr - xx * yr, xx * yy - xy * xy
        scale = 1.0 / (xx * a + xy * b + xr * c)
        a, b, c, d, e, f = (scale * value for value in (a, b, c, d, e, f))
        error = (a * bx + b * by + c * br, b * bx + d * by + e * br, c * bx + e * by + f * br)
        return (a, b, c, d, e, f), error
