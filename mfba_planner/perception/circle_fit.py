# SPDX-License-Identifier: Apache-2.0
"""Circles through returns and along edges: weighted Gauss-Newton for many circles at once.

A return p gives |p - c| - r = 0, weighted by the range's variance. A sure edge gives the tangent
between the last beam that met the circle and the first that did not: n . (c - o) + r = 0 with the
outward normal n, weighted by the variance of a uniform angle within that gap. Edges show the
width even where few returns show no curvature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import small_matrices as sm

Array = np.ndarray

MOST_RETURNS = 8.0  # returns of a circle that count as independent
_UNIFORM = 1.0 / 12.0  # variance of a uniform number in an interval of length 1
_TINY = 1e-9
_WEAK = 1.0 / 0.3**2  # information on a centre that nothing else shows, 1/m^2
LEAST_RADIUS_M = 0.01
_SYMMETRIC = np.array([0, 1, 2, 1, 3, 4, 2, 4, 5])  # from the upper triangle
_NINE = np.arange(9)[:, None]


@dataclass(frozen=True, slots=True)
class Returns:
    """k returns of g groups, one circle each, and e sure edges of these groups."""

    xy: Array  # (2, k) m
    group: Array  # (k,) int
    edge_xy: Array  # (2, e) m, origin of the beam at the edge
    normal: Array  # (2, e) outward
    edge_gap_m: Array  # (e,) width of the gap at the surface
    edge_group: Array  # (e,) int
    count: Array  # (g,) returns of each group


@dataclass(frozen=True, slots=True)
class Fit:
    """Measured circles: z = (x, y, r), its information matrix without the prior, residuals."""

    z: Array  # (3, g) m
    information: Array  # (3, 3, g) of returns and edges
    covariance: Array  # (3, 3, g) with the prior
    rms_m: Array  # (g,) of the returns' residuals
    vector: Array  # (3, g): information z, as returns and edges alone would have it


def fit(
    returns: Returns,
    start: Array,
    prior_radius_m: Array,
    prior_variance: Array,
    range_variance: float,
    passes: int = 2,
) -> Fit:
    """Fit the circles from their starts (3, g) and priors of the radius (g,).

    The centre has no prior but a weak one at the start, for groups that do not show it.
    """
    groups = start.shape[1]
    rows = _Rows(returns, range_variance, groups)
    prior = np.zeros((3, 3, groups))
    prior[0, 0] = prior[1, 1] = _WEAK
    prior[2, 2] = 1.0 / prior_variance
    anchor = start * _WEAK
    anchor[2] = prior_radius_m / prior_variance
    z = start
    for _ in range(passes):
        information, gradient = rows.normal_equations(z)
        covariance = sm.inverse(information + prior)
        vector = sm.applied(information, z)
        vector += gradient
        z = sm.applied(covariance, vector + anchor)
        np.maximum(z[2], LEAST_RADIUS_M, out=z[2])
    return Fit(z, information, covariance, rows.rms(z), vector)


class _Rows:
    """The linear equations of all returns, then of all edges."""

    def __init__(self, returns: Returns, range_variance: float, groups: int) -> None:
        self._returns, self._groups = returns, groups
        k, rows = returns.group.size, returns.group.size + returns.edge_group.size
        self._count = np.maximum(returns.count, 1.0)
        shared = np.minimum(1.0, MOST_RETURNS / self._count) / range_variance
        self._group = np.concatenate((returns.group, returns.edge_group))
        self._weight = np.empty(rows)
        self._weight[:k] = shared.take(returns.group)
        self._weight[k:] = 1.0 / (_UNIFORM * returns.edge_gap_m**2 + range_variance)
        self._h, self._residual = np.empty((2, rows)), np.empty(rows)
        self._h[:, k:] = returns.normal
        edge = returns.normal * returns.edge_xy
        self._edge = edge[0] + edge[1]
        self._sums = (self._group + groups * _NINE).ravel()
        self._terms = np.empty((9, rows))

    def normal_equations(self, z: Array) -> tuple[Array, Array]:
        """Information (3, 3, g) and gradient (3, g) at circles z (3, g)."""
        h, e, w, t = self._h, self._residual, self._weight, self._terms
        k = self._returns.group.size
        of = z.take(self._group, axis=1)
        d = self._distances(of[:2, :k], h[:, :k])
        d += _TINY
        h[:, :k] /= d
        np.subtract(d, of[2, :k], out=e[:k])
        along = h[:, k:] * of[:2, k:]
        e[k:] = self._edge - along[0] - along[1] - of[2, k:]
        np.multiply(w, h, out=t[2:5:2])
        t[5] = w
        np.multiply(t[2], h, out=t[:2])
        np.multiply(t[4], h[1], out=t[3])
        np.multiply(t[2:5:2], e, out=t[6:8])
        np.multiply(w, e, out=t[8])
        total = np.bincount(self._sums, t.ravel(), 9 * self._groups).reshape(9, -1)
        return total.take(_SYMMETRIC, axis=0).reshape(3, 3, -1), total[6:]

    def rms(self, z: Array) -> Array:
        """Root mean square (g,) of the returns' distances from circles z (3, g)."""
        group = self._returns.group
        of = z.take(group, axis=1)
        e = self._distances(of[:2], np.empty((2, group.size)))
        e -= of[2]
        e *= e
        rms: Array = np.sqrt(np.bincount(group, e, self._groups) / self._count)
        return rms

    def _distances(self, centers: Array, relative: Array) -> Array:
        """Of the returns (k,) from points (2, k); relative (2, k) gets the differences."""
        np.subtract(self._returns.xy, centers, out=relative)
        squares = relative * relative
        d: Array = np.add(squares[0], squares[1], out=squares[0])
        return np.sqrt(d, out=d)


def start_of(
    origin: Array, nearest_m: Array, right: Array, left: Array, sure: Array, radius_m: Array
) -> Array:
    """First guess (3, g) from directions (2, g) to both edges and the range of the nearest return.

    Where both edges are sure, the tangents give the radius: r = (d + r) sin(alpha) with half the
    angle between them; otherwise it is radius_m (g,). A group of more than half a turn is no
    circle, whatever the start.
    """
    middle = right + left
    length, along = _dot(middle, middle), _dot(right, left)
    np.sqrt(length, out=length)
    length += _TINY
    half = np.sqrt(np.maximum(0.5 - 0.5 * along, 0.0))  # sine of half the angle
    np.minimum(half, 0.95, out=half)
    tangent = nearest_m * half / (1.0 - half)
    np.minimum(np.maximum(tangent, LEAST_RADIUS_M, out=tangent), 3.0, out=tangent)
    start = np.empty((3, nearest_m.size))
    r = start[2] = np.where(sure, tangent, radius_m)
    middle *= (nearest_m + r) / length
    np.add(origin, middle, out=start[:2])
    return start


def _dot(a: Array, b: Array) -> Array:
    """Scalar products (g,) of (2, g) and (2, g)."""
    ab = a * b
    total: Array = ab[0] + ab[1]
    return total
