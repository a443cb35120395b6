# SPDX-License-Identifier: Apache-2.0
"""Circle fits against circles whose returns and tangents are known."""

import math
from dataclasses import replace

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


def test_the_rms_is_that_of_the_distances_from_the_circle() -> None:
    """Returns 0.01 m off in turn, inside and outside, around a circle that stays as it is."""
    exact = returns_of(2.0, 1.0, 0.3, edges=False)
    off = 0.01 * (-1.0) ** np.arange(12)
    xy = np.array([[2.0], [1.0]]) + (exact.xy - [[2.0], [1.0]]) * (1.0 + off / 0.3)
    z = np.array([[2.0], [1.0], [0.3]])
    # A sure prior: range_variance is so large that the returns do not move the circle.
    found = fit(replace(exact, xy=xy), z, np.full(1, 0.3), np.full(1, 1e-12), 1e9, 1)
    assert np.allclose(found.z, z, atol=1e-6)
    assert found.rms_m[0] == pytest.approx(0.01, rel=1e-4)


def test_each_group_has_its_own_circle() -> None:
    """Two at once give what each gives alone."""
    circles = ((2.0, 1.0, 0.3), (3.0, -2.0, 0.6))
    one, other = (returns_of(*circle, edges=True) for circle in circles)
    both = Returns(
        xy=np.hstack((one.xy, other.xy)),
        group=np.concatenate((one.group, other.group + 1)),
        edge_xy=np.hstack((one.edge_xy, other.edge_xy)),
        normal=np.hstack((one.normal, other.normal)),
        edge_gap_m=np.concatenate((one.edge_gap_m, other.edge_gap_m)),
        edge_group=np.concatenate((one.edge_group, other.edge_group + 1)),
        count=np.concatenate((one.count, other.count)),
    )
    start = np.array(circles).T + 0.02
    prior, variance = np.array([0.25, 0.5]), np.array([0.0625, 0.1])
    found = fit(both, start, prior, variance, 1e-4, 3)
    for k, returns in enumerate((one, other)):
        alone = fit(returns, start[:, k : k + 1], prior[k : k + 1], variance[k : k + 1], 1e-4, 3)
        assert np.allclose(found.z[:, k], alone.z[:, 0])
        assert np.allclose(found.covariance[:, :, k], alone.covariance[:, :, 0])
        assert found.rms_m[k] == pytest.approx(alone.rms_m[0])


def test_without_information_prior_and_start_hold() -> None:
    returns = returns_of(2.0, 1.0, 0.3, edges=False)
    start = np.array([[2.1], [0.8], [0.5]])
    found = fit(returns, start, np.full(1, 0.4), np.full(1, 0.05), 1e12, 2)
    assert found.z[:, 0].tolist() == pytest.approx([2.1, 0.8, 0.4])
    assert np.allclose(found.covariance[:, :, 0], np.diag([0.3**2, 0.3**2, 0.05]))


@pytest.mark.parametrize("half", [0.05, 0.4, 1.2])
def test_a_start_without_sure_edges_has_the_radius_that_is_given(half: float) -> None:
    """In the direction of the middle, behind the nearest return, from any origin."""
    right, left = (np.array([[math.cos(a)], [math.sin(a)]]) for a in (0.7 - half, 0.7 + half))
    origin = np.array([[1.0], [-3.0]])
    start = start_of(origin, np.full(1, 2.0), right, left, np.full(1, False), np.full(1, 0.4))
    expected = [1.0 + 2.4 * math.cos(0.7), -3.0 + 2.4 * math.sin(0.7), 0.4]
    assert start[:, 0].tolist() == pytest.approx(expected)
