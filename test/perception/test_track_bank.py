# SPDX-License-Identifier: Apache-2.0
"""Filters of the tracks against the textbook's equations of the Kalman filter."""

import numpy as np
import pytest

from mfba_planner.perception.track_bank import TrackBank

SPEED_SD = 0.7


def bank_of_one() -> TrackBank:
    bank = TrackBank()
    covariance = np.array([[0.02, 0.004, 0.001], [0.004, 0.03, 0.002], [0.001, 0.002, 0.01]])
    bank.add(
        np.array([[1.0], [2.0], [0.3]]), covariance[:, :, None], np.zeros(1), np.zeros(1), SPEED_SD
    )
    return bank


def test_prediction_is_that_of_constant_velocity_with_white_acceleration() -> None:
    bank = bank_of_one()
    P, dt, q = bank.covariance[:, :, 0].copy(), 0.2, 0.4**2
    F = np.eye(5)
    F[0, 3] = F[1, 4] = dt
    Q = np.zeros((5, 5))
    for k in (0, 1):
        Q[k, k], Q[k, k + 3], Q[k + 3, k], Q[k + 3, k + 3] = dt**3 / 3, dt**2 / 2, dt**2 / 2, dt
    bank.predict(np.full(1, dt), 0.4)
    expected = F @ P @ F.T + q * Q
    expected[2, 2] += 0.02**2 * dt
    assert np.allclose(bank.covariance[:, :, 0], expected)
    assert np.allclose(bank.state[:, 0], [1.0, 2.0, 0.3, 0.0, 0.0])


def test_update_is_that_of_the_kalman_filter() -> None:
    bank = bank_of_one()
    bank.predict(np.full(1, 0.1), 0.1)
    x, P = bank.state[:, 0].copy(), bank.covariance[:, :, 0].copy()
    R = np.array([[0.02, 0.001, 0.0], [0.001, 0.03, 0.002], [0.0, 0.002, 0.01]])
    N = np.diag([0.004, 0.006, 0.0])
    z = np.array([1.05, 1.96, 0.32])
    H = np.zeros((3, 5))
    H[0, 0] = H[1, 1] = H[2, 2] = 1.0
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R + N)
    information = np.linalg.inv(R)
    vector = (information @ z)[:, None]
    bank.update(np.array([0]), information[:, :, None], vector, N[:, :, None], SPEED_SD)
    assert np.allclose(bank.state[:, 0], x + K @ (z - H @ x))
    assert np.allclose(bank.covariance[:, :, 0], P - K @ H @ P)
    # Of the difference, the odometry's error has the share N (P + R + N)^-1.
    share = N @ np.linalg.inv(H @ P @ H.T + R + N) @ (z - H @ x)
    assert np.allclose(bank.shift_m[:, 0], share[:2])


def test_a_direction_without_information_stays_as_it_was() -> None:
    bank = bank_of_one()
    bank.covariance[:, :, 0] = np.diag([0.02, 0.03, 0.01, 0.5, 0.5])
    information = np.diag([1e4, 0.0, 0.0])[:, :, None]
    vector = np.array([[1e4 * 1.01], [0.0], [0.0]])
    bank.update(np.array([0]), information, vector, np.zeros((3, 3, 1)), 0.5)
    assert bank.state[0, 0] == pytest.approx(1.01, abs=1e-3)
    assert bank.state[1, 0] == 2.0
    assert bank.covariance[1, 1, 0] == pytest.approx(0.03)


def test_a_contradiction_makes_the_velocity_unknown_again() -> None:
    bank = bank_of_one()
    bank.covariance[:, :, 0] = np.diag([1e-4, 1e-4, 1e-4, 1e-3, 1e-3])
    bank.predict(np.full(1, 0.1), 0.0)
    information = np.diag([1e4, 1e4, 1e4])[:, :, None]
    z = np.array([[1.1], [2.0], [0.3]])
    bank.update(np.array([0]), information, 1e4 * z, np.zeros((3, 3, 1)), 1.0)
    assert bank.state[3, 0] == pytest.approx(1.0, abs=0.15)  # 0.1 m in 0.1 s
    assert bank.speed_sd_mps[0] > 0.1


def test_kept_tracks_keep_all_that_is_known_of_them() -> None:
    bank = bank_of_one()
    z, covariance = np.array([[5.0], [6.0], [0.1]]), np.eye(3)[:, :, None]
    bank.add(z, covariance, np.ones(1), np.ones(1), SPEED_SD)
    bank.keep(np.array([False, True]))
    assert bank.count == 1
    assert bank.state[:2, 0].tolist() == [5.0, 6.0]
    assert (bank.time_s[0], bank.rms_m[0]) == (1.0, 1.0)
    assert all(getattr(bank, name).shape[-1] == 1 for name in TrackBank._ARRAYS)
    # The sums of small_matrices are added in order only then.
    assert all(getattr(bank, name).flags.c_contiguous for name in TrackBank._ARRAYS)


@pytest.mark.parametrize("moving", [False, True])
def test_what_rests_is_expected_where_it_was_before_the_prediction(moving: bool) -> None:
    """At rest the state goes back by B = (1, -dt), and its covariance with it."""
    bank, dt = bank_of_one(), 0.2
    rng = np.random.default_rng(3)
    A = rng.normal(size=(5, 5))
    bank.covariance[:, :, 0] = P = A @ A.T
    bank.state[3:, 0] = (0.4, -0.7)
    bank.predicted_s[:] = dt
    bank.moving[:] = moving
    B = np.eye(2, 5) if moving else np.hstack((np.eye(2), np.zeros((2, 1)), -dt * np.eye(2)))
    creep = 0.0 if moving else 0.005**2
    state, covariance = bank.state[:, 0].copy(), P.copy()
    center, found = bank.expected(np.array([0]))
    assert center[:, 0] == pytest.approx(B @ state)
    assert np.allclose(found[:, :, 0], B @ covariance @ B.T + creep * np.eye(2))
