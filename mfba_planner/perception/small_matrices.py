# SPDX-License-Identifier: Apache-2.0
"""Products and inverses of m small matrices at once; the last axis counts them.

So a component of all of them is one contiguous row, and few calls of numpy do the work. The sums
are added in one order: BLAS and LAPACK round differently on different machines, and these do not.
Arrays must be in C order (take and compress keep it, an index array on the last axis does not):
otherwise numpy may add in another order.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def product(a: Array, b: Array) -> Array:
    """(i, j, m) times (j, k, m): (i, k, m)."""
    total: Array = np.add.reduce(a[:, :, None] * b, axis=1)
    return total


def applied(a: Array, x: Array) -> Array:
    """(i, j, m) times (j, m): (i, m)."""
    total: Array = np.add.reduce(a * x, axis=1)
    return total


# Cofactor (j, i) of a matrix in row order is a[p] a[q] - a[s] a[t]: first all p, then all s.
_FIRST = np.array([4, 2, 1, 5, 0, 2, 3, 1, 0, 5, 1, 2, 3, 2, 0, 4, 0, 1])
_SECOND = np.array([8, 7, 5, 6, 8, 3, 7, 6, 4, 7, 8, 4, 8, 6, 5, 6, 7, 3])


def inverse(a: Array) -> Array:
    """Inverses of (3, 3, m) by cofactors; each matrix must be regular."""
    flat = a.reshape(9, -1)
    products = flat.take(_FIRST, axis=0)
    products *= flat.take(_SECOND, axis=0)
    out = products[:9]
    out -= products[9:]
    out /= np.add.reduce(flat[:3] * out[::3], axis=0)
    inverses: Array = out.reshape(a.shape)
    return inverses
