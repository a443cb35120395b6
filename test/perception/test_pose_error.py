# SPDX-License-Identifier: Apache-2.0
"""The odometry's error from what all tracks have in common."""

import math

import numpy as np
import pytest

from mfba_planner.perception.pose_error import PoseError

ORIGIN = (1.0, -2.0)
CENTERS = np.array([[4.0, 0.0], [0.0, 3.0], [-3.0, -2.0], [2.0, -6.0], [5.0, 4.0]])
COVARIANCE = np.tile(1e-6 * np.eye(2)[:, :, None], (1, 1, 5))


def moved(x: float, y: float, turn: float) -> np.ndarray:
    c, s = math.cos(turn), math.sin(turn)
    return (CENTERS - ORIGIN) @ np.array([[c, s], [-s, c]]) + ORIGIN + (x, y)


def estimate(error: PoseError, measured: np.ndarray, count: int = 5) -> None:
    settled = np.full(count, True)
    error.estimate(
        measured[:count].T, CENTERS[:count].T, COVARIANCE[:, :, :count], settled, ORIGIN
    )


def test_a_common_motion_is_the_odometry_s_error() -> None:
    error = PoseError()
    estimate(error, moved(0.02, -0.01, 0.015))
    assert error.error == pytest.approx((0.02, -0.01, 0.015), abs=1e-3)
    dx, dy = error.shift(CENTERS[:, 0], CENTERS[:, 1], ORIGIN)
    assert np.allclose(CENTERS + np.column_stack((dx, dy)), moved(0.02, -0.01, 0.015), atol=3e-3)


def test_one_that_moves_differently_is_left_out() -> None:
    error, measured = PoseError(), moved(0.01, 0.02, 0.01)
    measured[2] += (0.2, -0.1)
    estimate(error, measured)
    assert error.error == pytest.approx((0.01, 0.02, 0.01), abs=2e-3)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_one_or_two_tracks_tell_no_error(count: int) -> None:
    error = PoseError()
    estimate(error, moved(0.02, 0.0, 0.0), count)
    assert error.error == (0.0, 0.0, 0.0)


def test_obstacles_that_all_move_on_their_own_tell_no_error() -> None:
    error, rng = PoseError(), np.random.default_rng(4)
    estimate(error, CENTERS + rng.normal(0.0, 0.3, (5, 2)))
    assert error.error == (0.0, 0.0, 0.0)


def test_the_variances_are_learnt() -> None:
    quiet, noisy, rng = PoseError(), PoseError(), np.random.default_rng(5)
    for _ in range(40):
        estimate(quiet, CENTERS)
        x, y, turn = rng.normal(0.0, (0.03, 0.03, 0.01))
        estimate(noisy, moved(x, y, turn))
    assert quiet.sd_m < 2e-3
    assert quiet.sd_rad < 2e-3
    assert 0.015 < noisy.sd_m < 0.045
    assert 0.005 < noisy.sd_rad < 0.02


def test_noise_left_is_that_of_a_rigid_motion() -> None:
    left = np.array([[4.0, 0.5, 0.2], [0.5, 3.0, -0.1], [0.2, -0.1, 0.3]])
    J = np.array([[1.0, 0.0, ORIGIN[1] - 4.0], [0.0, 1.0, 3.0 - ORIGIN[0]]])
    upper = (4.0, 0.5, 0.2, 3.0, -0.1, 0.3)
    noise = PoseError.noise(np.array([[3.0], [4.0]]), upper, ORIGIN)
    assert np.allclose(noise[:2, :2, 0], J @ left @ J.T)
    assert not noise[2, :, 0].any()


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_the_share_that_is_followed_is_taken_off_the_error(share: float) -> None:
    error = PoseError()
    error.error = (0.2, -0.4, 0.08)
    taken = error.follow(share)
    assert taken == pytest.approx((0.2 * share, -0.4 * share, 0.08 * share))
    left = [before - off for before, off in zip((0.2, -0.4, 0.08), taken)]
    assert error.error == pytest.approx(left)
