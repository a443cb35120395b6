# SPDX-License-Identifier: Apache-2.0
"""Products and inverses of many small matrices against numpy.linalg."""

import numpy as np
import pytest

from mfba_planner.perception import small_matrices as sm


@pytest.mark.parametrize("count", [0, 1, 7])
def test_products_and_inverses_equal_those_of_numpy(count: int) -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(count, 5, 3)), rng.normal(size=(count, 3, 4))
    x, square = rng.normal(size=(count, 3)), rng.normal(size=(count, 3, 3)) + 3.0 * np.eye(3)
    assert np.allclose(sm.product(a, b), a @ b)
    assert np.allclose(sm.applied(a, x), (a @ x[:, :, None])[:, :, 0])
    assert np.allclose(sm.inverse(square), np.linalg.inv(square))
