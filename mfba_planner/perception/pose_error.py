# SPDX-License-Identifier: Apache-2.0
"""The odometry's error of one scan, from what all tracks have in common.

An odometry that errs moves all obstacles of a scan alike; obstacles that move do not. The error
(x, y, turn) is estimated by least squares from the differences between measured and predicted
centres, with a prior of variances that are learnt from the errors of the scans before.
"""

from __future__ import annotations

import math

import numpy as np

from . import small_matrices as sm

Array = np.ndarray

_LEARNING = 0.1  # weight of one scan in the variances
_LEAST_SD, _MOST_SD = 1e-3, 0.06  # m and rad
_FIRST_SD = 5e-3
_OUTLIER = 9.0  # squared Mahalanobis distance


class PoseError:
    """The error of the present scan's pose and the variances of such errors."""

    def __init__(self) -> None:
        """Start with small variances and no error."""
        self.variance_m2 = _FIRST_SD**2
        self.variance_rad2 = _FIRST_SD**2
        self.error = (0.0, 0.0, 0.0)

    @property
    def sd_m(self) -> float:
        """Standard deviation of the position, per axis."""
        return math.sqrt(self.variance_m2)

    @property
    def sd_rad(self) -> float:
        """Standard deviation of the heading."""
        return math.sqrt(self.variance_rad2)

    def shift(self, x: Array, y: Array, origin: Array) -> tuple[Array, Array]:
        """How far the present error has moved measured points."""
        ex, ey, turn = self.error
        return ex - turn * (y - origin[1]), ey + turn * (x - origin[0])

    def estimate(
        self, measured: Array, predicted: Array, covariance: Array, origin: Array
    ) -> Array:
        """Estimate the error from centres (j, 2) and their covariances (j, 2, 2).

        Returns the covariance (3, 3) that is left.
        """
        self.error = (0.0, 0.0, 0.0)
        vm, vr = self.variance_m2, self.variance_rad2
        prior = np.diag([1.0 / vm, 1.0 / vm, 1.0 / vr])
        if not measured.shape[0]:
            return np.diag([vm, vm, vr])
        e = measured - predicted
        px, py = origin[1] - predicted[:, 1], predicted[:, 0] - origin[0]  # per rad
        sxx, sxy, syy = covariance[:, 0, 0], covariance[:, 0, 1], covariance[:, 1, 1]
        txx, txy, tyy = sxx + vm + vr * px * px, sxy + vr * px * py, syy + vm + vr * py * py
        ex, ey = e[:, 0], e[:, 1]
        length = (tyy * ex * ex - 2.0 * txy * ex * ey + txx * ey * ey) / (txx * tyy - txy * txy)
        fits = length < _OUTLIER
        scale = fits / (sxx * syy - sxy * sxy)
        ixx, ixy, iyy = scale * syy, -scale * sxy, scale * sxx
        gx, gy = ixx * ex + ixy * ey, ixy * ex + iyy * ey
        ixr, iyr = ixx * px + ixy * py, ixy * px + iyy * py
        rows = [ixx, ixy, iyy, ixr, iyr, px * ixr + py * iyr, gx, gy, px * gx + py * gy]
        xx, xy, yy, xr, yr, rr, bx, by, br = (math.fsum(row.tolist()) for row in rows)
        information = np.array([[xx, xy, xr], [xy, yy, yr], [xr, yr, rr]]) + prior
        left: Array = sm.inverse(information[None])[0]
        error = sm.applied(left[None], np.array([[bx, by, br]]))[0]
        self.error = (float(error[0]), float(error[1]), float(error[2]))
        second = 0.5 * (error[0] ** 2 + error[1] ** 2 + left[0, 0] + left[1, 1])
        self.variance_m2 = self._learnt(vm, float(second))
        self.variance_rad2 = self._learnt(vr, float(error[2] ** 2 + left[2, 2]))
        return left

    @staticmethod
    def _learnt(variance: float, sample: float) -> float:
        learnt = variance + _LEARNING * (sample - variance)
        return min(max(learnt, _LEAST_SD**2), _MOST_SD**2)
