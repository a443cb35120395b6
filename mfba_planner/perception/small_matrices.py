# SPDX-License-Identifier: Apache-2.0
"""Products and inverses of many small matrices at once.

Sums and products of arrays only, in one order: BLAS and LAPACK round differently on different
machines, and these do not.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def product(a: Array, b: Array) -> Array:
    """(m, i, j) times (m, j, k): (m, i, k)."""
    total = a[:, :, 0, None] * b[:, None, 0, :]
    for j in range(1, a.shape[2]):
        total += a[:, :, j, None] * b[:, None, j, :]
    return total


def applied(a: Array, x: Array) -> Array:
    """(m, i, j) times (m, j): (m, i)."""
    total: Array = a[:, :, 0] * x[:, 0, None]
    for j in range(1, a.shape[2]):
        total += a[:, :, j] * x[:, j, None]
    return total


# Cofactor (j, i) of a matrix in row order is a[p] a[q] - a[s] a[t].
_P = np.array([4, 2, 1, 5, 0, 2, 3, 1, 0])
_Q = np.array([8, 7, 5, 6, 8, 3, 7, 6, 4])
_S = np.array([5, 1, 2, 3, 2, 0, 4, 0, 1])
_T = np.array([7, 8, 4, 8, 6, 5, 6, 7, 3])


def inverse(a: Array) -> Array:
    """Inverses of (m, 3, 3) by cofactors; each matrix must be regular."""
    flat = a.reshape(-1, 9)
    out: Array = flat[:, _P] * flat[:, _Q]
    out -= flat[:, _S] * flat[:, _T]
    out /= (flat[:, 0] * out[:, 0] + flat[:, 1] * out[:, 3] + flat[:, 2] * out[:, 6])[:, None]
    return out.reshape(-1, 3, 3)
