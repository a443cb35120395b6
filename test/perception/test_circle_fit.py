# SPDX-License-Identifier: Apache-2.0
"""Circle fits against circles whose returns and tangents are known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.perception.circle_fit import Returns, fit, start_of

Array = np.ndarray


def returns_of(x: float, y: float, r: float, *, edges: bool) -> Returns:
    """Twelve exact returns of the side that faces the origin, and the tangents from there."""
    bearing, d = math.atan2(y, x), math.hypot(x, y)
    angles = bearing + math.pi + np.linspace(-1.1, 1.1, 12)
    half = math.asin(r / d)
    normals = [(math.sin(bearing - half), -math.cos(bearing - half))]
    normals.append((-math.sin(bearing + half), math.cos(bearing + half)))
    normal = np.array(normals if edges else np.empty((0, 2))).T
    zero = np.zeros(normal.shape[1])
    return Returns(
        xy=np.array((x + r * np.cos(angles), y + r * np.sin(angles))),
        group=np.zeros(12, dtype=np.int64),
        edge_xy=np.zeros(normal.shape),
        normal=normal,
        edge_gap_m=zero + 0.02,
        edge_group=zero.astype(np.int64),
        count=np.full(1, 12.0),
    )


@given(x=st.floats(1.0, 5.0), y=st.floats(-5.0, 5.0), r=st.floats(0.05, 0.95), edges=st.booleans())
@settings(max_examples=50)
def test_exact_returns_give_the_circle(x: float, y: float, r: float, edges: bool) -> None:
    start = np.array([[x + 0.02], [y - 0.03], [r + 0.02]])
    found = fit(
        returns_of(x, y, r, edges=edges), start, np.full(1, 0.25), np.full(1, 0.0625), 1e-6, 6
    )
    assert np.allclose(found.z[:, 0], [x, y, r], atol=2e-3)
    assert found.rms_m[0] < 1e-3


def test_information_is_that_of_the_linear_equations() -> None:
    returns = returns_of(2.0, 1.0, 0.3, edges=True)
    z = np.array([[2.0], [1.0], [0.3]])
    found = fit(returns, z, np.full(1, 0.3), np.full(1, 1.0), 1e-4, 1)
    H = np.column_stack((returns.xy[0] - 2.0, returns.xy[1] - 1.0, np.full(12, 0.3))) / 0.3
    E = np.column_stack((*returns.normal, np.ones(2)))
    expected = (8.0 / 12.0) / 1e-4 * H.T @ H + E.T @ E / (0.02**2 / 12.0 + 1e-4)
    assert np.allclose(found.information[:, :, 0], expected, rtol=1e-6)
    assert np.allclose(found.vector, expected @ z, rtol=1e-6)


def test_two_tangents_and_the_nearest_point_give_the_start() -> None:
    bearing, half, d = 0.4, 0.2, 2.0
    right, left = (
        np.array([[math.cos(a)], [math.sin(a)]]) for a in (bearing - half, bearing + half)
    )
    sure = np.full(1, True)
    start = start_of(np.zeros((2, 1)), np.full(1, d), right, left, sure, np.full(1, 9.0))
    r = d * math.sin(half) / (1.0 - math.sin(half))
    expected = [(d + r) * math.cos(bearing), (d + r) * math.sin(bearing), r]
    assert start[:, 0].tolist() == pytest.approx(expected)
