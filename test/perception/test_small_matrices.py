# SPDX-License-Identifier: Apache-2.0
"""Products and inverses of many small matrices against numpy.linalg."""

import numpy as np
import pytest

from mfba_planner.perception import small_matrices as sm


@pytest.mark.parametrize("count", [0, 1, 7])
def test_products_and_inverses_equal_those_of_numpy(count: int) -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(5, 3, count)), rng.normal(size=(3, 4, count))
    x, square = rng.normal(size=(3, count)), rng.normal(size=(3, 3, count))
    square += 3.0 * np.eye(3)[:, :, None]
    assert np.allclose(sm.product(a, b).T, b.T @ a.T)
    assert np.allclose(sm.applied(a, x).T, (x.T[:, None] @ a.T)[:, 0])
    assert np.allclose(sm.inverse(square).T, np.linalg.inv(square.T))


@pytest.mark.parametrize("count", [1, 2, 3, 8, 9, 33])
def test_sums_are_added_in_order_so_that_every_machine_rounds_alike(count: int) -> None:
    rng = np.random.default_rng(count)
    a, b, x = (rng.normal(size=(*n, count)) for n in ((5, 3), (3, 4), (3,)))
    product, applied = sm.product(a, b), sm.applied(a, x)
    for m in range(count):
        A, B, X = a[:, :, m].tolist(), b[:, :, m].tolist(), x[:, m].tolist()
        for i, row in enumerate(A):
            assert applied[i, m] == row[0] * X[0] + row[1] * X[1] + row[2] * X[2]
            for k in range(4):
                total = row[0] * B[0][k] + row[1] * B[1][k] + row[2] * B[2][k]
                assert product[i, k, m] == total
