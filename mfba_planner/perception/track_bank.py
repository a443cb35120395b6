# SPDX-License-Identifier: Apache-2.0
"""The tracks' states on arrays: extended Kalman filters of circles at constant velocity."""

from __future__ import annotations

import numpy as np

from ..core.geometry import Point
from . import small_matrices as sm

Array = np.ndarray

RADIUS, VX, VY = 2, 3, 4
_RADIUS_DRIFT = 0.02  # m/s^0.5; edges err alike in many scans, so old ones must not count for ever
_TURNED = 12.0  # squared Mahalanobis length of a correction at which the velocity is unknown again
_ACCELERATION_PER_SPEED = 0.15  # 1/s^0.5; what is fast changes its velocity by more
_CREEP_M = 0.005  # that something may move between two scans before it counts as moving
_EYE = np.eye(3)[:, :, None]
# Places in the 25 rows of the covariances: (x, x) and (y, y); the same of the velocities; (x, vx)
# and (y, vy), above and below the diagonal.
_POSITION, _VELOCITY = slice(0, 7, 6), slice(18, 25, 6)
_CROSS, _CROSS_BELOW = slice(3, 10, 6), slice(15, 22, 6)


class TrackBank:
    """m tracks with states (x, y, r, vx, vy), each at its own time; the last axis counts them.

    time_s is that of the state after the stamp of the last scan: beams of one scan may differ in
    time. unseen_s and known_s: since the last and between first and last return. moving: whether
    the track moves; at rest its velocity is given as 0.
    """

    _ARRAYS = (
        "state",
        "covariance",
        "time_s",
        "predicted_s",
        "unseen_s",
        "known_s",
        "appeared_s",
        "moving",
        "scans",
        "rms_m",
        "missed",
        "streak",
        "shift_m",
    )

    def __init__(self) -> None:
        """Start without tracks."""
        self.state = np.empty((5, 0))
        self.covariance = np.empty((5, 5, 0))
        self.time_s = np.empty(0)
        self.predicted_s = np.empty(0)  # since the last return
        self.unseen_s = np.empty(0)
        self.known_s = np.empty(0)
        self.appeared_s = np.empty(0)  # since a return in space that had been seen free
        self.moving = np.empty(0, dtype=bool)
        self.scans = np.empty(0, dtype=np.int64)
        self.rms_m = np.empty(0)
        self.missed = np.empty(0, dtype=np.int64)  # scans in a row that saw through it
        self.streak = np.empty(0, dtype=np.int64)  # of a significant velocity, in scans
        self.shift_m = np.empty((2, 0))  # of the centre by the odometry's error, as far as known

    @property
    def count(self) -> int:
        """Number of tracks."""
        return self.state.shape[1]

    @property
    def position_sd_m(self) -> Array:
        """Standard deviation of the centre, mean of both axes; (m,)."""
        P = self.covariance
        sd: Array = np.sqrt(0.5 * (P[0, 0] + P[1, 1]))
        return sd

    @property
    def speed_sd_mps(self) -> Array:
        """Standard deviation of the velocity, mean of both axes; (m,)."""
        P = self.covariance
        sd: Array = np.sqrt(0.5 * (P[VX, VX] + P[VY, VY]))
        return sd

    def keep(self, kept: Array) -> None:
        """Drop the tracks where kept (m,) is False."""
        for name in self._ARRAYS:
            setattr(self, name, getattr(self, name).compress(kept, axis=-1))

    def pass_time(self, dt: float) -> None:
        """The next scan's stamp is dt seconds later."""
        self.time_s = self.time_s - dt
        self.unseen_s = self.unseen_s + dt
        self.shift_m.fill(0.0)
        self.appeared_s = self.appeared_s + dt

    def predict(self, to_s: Array, acceleration_sd: float) -> None:
        """Predict to times to_s (m,) at constant velocity."""
        dt = to_s - self.time_s
        v, P = self.state[VX:], self.covariance
        squares = v * v
        speed = np.sqrt(squares[0] + squares[1])
        self.state[:2] += dt * v
        P[:2] += dt * P[VX:]
        P[:, :2] += dt * P[:, VX:]
        # White-noise acceleration of spectral density q.
        length = np.abs(dt)
        q = (acceleration_sd + _ACCELERATION_PER_SPEED * speed) ** 2 * length
        rows = P.reshape(25, -1)
        rows[_POSITION] += dt * (1.0 / 3.0) * dt * q
        cross = dt * 0.5 * q
        rows[_CROSS] += cross
        rows[_CROSS_BELOW] += cross
        rows[_VELOCITY] += q
        P[RADIUS, RADIUS] += _RADIUS_DRIFT * _RADIUS_DRIFT * length
        self.time_s = to_s.copy()
        self.predicted_s = self.predicted_s + dt

    def turn_with(
        self, shift: tuple[float, float, float], rate: tuple[float, float, float], origin: Point
    ) -> None:
        """Move all tracks like a rigid body by (x, y, turn), and their velocities by a rate."""
        dx, dy = self.state[0] - origin[0], self.state[1] - origin[1]
        for k, (x, y, turn) in ((0, shift), (VX, rate)):
            self.state[k] += x - turn * dy
            self.state[k + 1] += y + turn * dx

    def expected(self, index: Array) -> tuple[Array, Array]:
        """Centres (2, j) and covariances (2, 2, j) of these tracks, at rest unless they move.

        Most things stand: what they have in common is then the odometry's error, and not their
        velocity.
        """
        state, P = self.state.take(index, axis=1), self.covariance.take(index, axis=2)
        rests = ~self.moving[index]
        dt = self.predicted_s[index] * rests
        block, cross = P[:2, :2], P[:2, VX:]
        block -= dt * (cross + cross.transpose(1, 0, 2)) - dt * dt * P[VX:, VX:]
        creep = _CREEP_M * _CREEP_M * rests
        block[0, 0] += creep
        block[1, 1] += creep
        return state[:2] - dt * state[VX:], block

    def update(
        self, index: Array, information: Array, vector: Array, noise: Array, speed_sd: float
    ) -> None:
        """Update the tracks of these indices by measured circles.

        information (3, 3, j) and vector (3, j) = information z of (x, y, r); noise (3, 3, j) is
        the covariance of what else errs. If the correction contradicts the prediction, the
        obstacle has turned: its velocity is unknown again since the last return.
        """
        state, covariance = self.state.take(index, axis=1), self.covariance.take(index, axis=2)
        new_state, new_covariance, shift, surprise = _corrected(
            state, covariance, information, vector, noise
        )
        turned = (surprise > _TURNED).nonzero()[0]
        if turned.size:
            self.streak[index[turned]] = 0
            variance, step = speed_sd * speed_sd, self.predicted_s[index[turned]]
            P = covariance.take(turned, axis=2)
            rows = P.reshape(25, -1)
            rows[_POSITION] += variance * step * step
            rows[_CROSS] += variance * step
            rows[_CROSS_BELOW] += variance * step
            rows[_VELOCITY] += variance
            again = (v.take(turned, axis=-1) for v in (information, vector, noise))
            new_state[:, turned], new_covariance[:, :, turned], shift[:, turned], _ = _corrected(
                state.take(turned, axis=1), P, *again
            )
        self.state[:, index], self.covariance[:, :, index] = new_state, new_covariance
        self.shift_m[:, index] = shift

    def add(
        self, z: Array, covariance: Array, time_s: Array, rms_m: Array, speed_sd: float
    ) -> None:
        """Add tracks at rest from measured circles (3, j) and their covariances (3, 3, j)."""
        j = z.shape[1]
        state, P = np.zeros((5, j)), np.zeros((5, 5, j))
        state[:VX], P[:VX, :VX] = z, covariance
        P[VX, VX] = P[VY, VY] = speed_sd * speed_sd
        zero = np.zeros(j)
        new: dict[str, Array] = {
            "state": state,
            "covariance": P,
            "time_s": time_s,
            "predicted_s": zero,
            "unseen_s": zero,
            "known_s": zero,
            "appeared_s": np.full(j, np.inf),
            "moving": np.zeros(j, dtype=bool),
            "scans": np.ones(j, dtype=np.int64),
            "rms_m": rms_m,
            "missed": np.zeros(j, dtype=np.int64),
            "streak": np.zeros(j, dtype=np.int64),
            "shift_m": np.zeros((2, j)),
        }
        for name in self._ARRAYS:
            setattr(self, name, np.concatenate((getattr(self, name), new[name]), axis=-1))


def _corrected(
    state: Array, covariance: Array, information: Array, vector: Array, noise: Array
) -> tuple[Array, Array, Array, Array]:
    """Posterior states and covariances, errors of the centres, and the corrections' lengths.

    With the information L and l = L z of a measurement of the part z of the state, and further
    noise N of it, x' = x + P_z S (l - L x_z) and P' = P - P_z S L P_z^T where
    S = (I + L (P_zz + N))^-1. L may be singular: what the scan does not show stays as it was.
    Of the difference, N S (l - L x_z) is that error. The lengths are squared Mahalanobis ones.
    """
    columns = covariance[:, :VX]
    total = sm.product(information, columns[:VX] + noise)
    total += _EYE
    weighted = np.empty((3, 4, state.shape[1]))  # L and l - L x_z side by side
    weighted[:, :3] = information
    np.subtract(vector, sm.applied(information, state[:VX]), out=weighted[:, 3])
    weighted = sm.product(sm.inverse(total), weighted)
    y = weighted[:, 3]
    gain = sm.product(columns, weighted)
    shift = gain[:, 3]
    changed = state + shift
    np.maximum(changed[RADIUS], 0.01, out=changed[RADIUS])
    surprise: Array = np.add.reduce(shift[:VX] * y, axis=0)
    reduced = covariance - sm.product(gain[:, :3], columns.transpose(1, 0, 2))
    reduced = reduced + reduced.transpose(1, 0, 2)
    reduced *= 0.5
    error = noise[:2, 0] * y[0] + noise[:2, 1] * y[1]
    return changed, reduced, error, surprise
