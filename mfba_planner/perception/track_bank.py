# SPDX-License-Identifier: Apache-2.0
"""The tracks' states on arrays: extended Kalman filters of circles at constant velocity."""

from __future__ import annotations

import numpy as np

from . import small_matrices as sm

Array = np.ndarray

VX, VY, RADIUS = 2, 3, 4
_Z = np.array([0, 1, RADIUS])  # what a scan measures
_RADIUS_DRIFT = 0.02  # m/s^0.5; edges err alike in many scans, so old ones must not count for ever
_TURNED = 12.0  # squared Mahalanobis length of a correction at which the velocity is unknown again
_ACCELERATION_PER_SPEED = 0.15  # 1/s^0.5; what is fast changes its velocity by more
_CREEP_M = 0.005  # that something may move between two scans before it counts as moving
_EYE = np.eye(3)
# White-noise acceleration of spectral density q during t: q t (A t^2 + B t + C) of the covariance.
_Q_POSITION, _Q_CROSS, _Q_VELOCITY = np.zeros((3, 5, 5))
for _k in (0, 1):
    _Q_POSITION[_k, _k] = 1.0 / 3.0
    _Q_CROSS[_k, _k + 2] = _Q_CROSS[_k + 2, _k] = 0.5
    _Q_VELOCITY[_k + 2, _k + 2] = 1.0


class TrackBank:
    """m tracks with states (x, y, vx, vy, r), each at its own time.

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
        self.state = np.empty((0, 5))
        self.covariance = np.empty((0, 5, 5))
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
        self.shift_m = np.empty((0, 2))  # of the centre by the odometry's error, as far as known

    @property
    def count(self) -> int:
        """Number of tracks."""
        return self.state.shape[0]

    @property
    def position_sd_m(self) -> Array:
        """Standard deviation of the centre, mean of both axes; (m,)."""
        P = self.covariance
        sd: Array = np.sqrt(0.5 * (P[:, 0, 0] + P[:, 1, 1]))
        return sd

    @property
    def speed_sd_mps(self) -> Array:
        """Standard deviation of the velocity, mean of both axes; (m,)."""
        P = self.covariance
        sd: Array = np.sqrt(0.5 * (P[:, VX, VX] + P[:, VY, VY]))
        return sd

    def keep(self, kept: Array) -> None:
        """Drop the tracks where kept (m,) is False."""
        for name in self._ARRAYS:
            setattr(self, name, getattr(self, name)[kept])

    def pass_time(self, dt: float) -> None:
        """The next scan's stamp is dt seconds later."""
        self.time_s = self.time_s - dt
        self.unseen_s = self.unseen_s + dt
        self.shift_m[:] = 0.0
        self.appeared_s = self.appeared_s + dt

    def predict(self, to_s: Array, acceleration_sd: float) -> None:
        """Predict to times to_s (m,) at constant velocity."""
        dt = to_s - self.time_s
        v = self.state[:, 2:4]
        speed = np.sqrt(v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1])
        self.state[:, :2] += dt[:, None] * v
        P, step = self.covariance, dt[:, None, None]
        P[:, :2, :] += step * P[:, 2:4, :]
        P[:, :, :2] += step * P[:, :, 2:4]
        length = np.abs(dt)
        q = (acceleration_sd + _ACCELERATION_PER_SPEED * speed) ** 2 * length
        noise = step * _Q_POSITION
        noise += _Q_CROSS
        noise *= step
        noise += _Q_VELOCITY
        noise *= q[:, None, None]
        P += noise
        P[:, RADIUS, RADIUS] += _RADIUS_DRIFT * _RADIUS_DRIFT * length
        self.time_s = to_s.copy()
        self.predicted_s = self.predicted_s + dt

    def turn_with(
        self, shift: tuple[float, float, float], rate: tuple[float, float, float], origin: Array
    ) -> None:
        """Move all tracks like a rigid body by (x, y, turn), and their velocities by a rate."""
        dx, dy = self.state[:, 0] - origin[0], self.state[:, 1] - origin[1]
        for k, (x, y, turn) in ((0, shift), (VX, rate)):
            self.state[:, k] += x - turn * dy
            self.state[:, k + 1] += y + turn * dx

    def expected(self, index: Array) -> tuple[Array, Array]:
        """Centres (j, 2) and covariances (j, 2, 2) of these tracks, at rest unless they move.

        Most things stand: what they have in common is then the odometry's error, and not their
        velocity.
        """
        moving = self.moving[index]
        state, P = self.state[index], self.covariance[index]
        dt = self.predicted_s[index]
        center = state[:, :2] - np.where(moving, 0.0, dt)[:, None] * state[:, 2:4]
        block = P[:, :2, :2].copy()
        step = np.where(moving, 0.0, dt)[:, None, None]
        cross, speed = P[:, :2, 2:4], P[:, 2:4, 2:4]
        block -= step * (cross + cross.transpose(0, 2, 1)) - step * step * speed
        block[:, 0, 0] += np.where(moving, 0.0, _CREEP_M * _CREEP_M)
        block[:, 1, 1] += np.where(moving, 0.0, _CREEP_M * _CREEP_M)
        return center, block

    def update(
        self, index: Array, information: Array, vector: Array, noise: Array, speed_sd: float
    ) -> None:
        """Update the tracks of these indices by measured circles.

        information (j, 3, 3) and vector (j, 3) = information z of (x, y, r); noise (j, 3, 3) is
        the covariance of what else errs. If the correction contradicts the prediction, the
        obstacle has turned: its velocity is unknown again since the last return.
        """
        state, covariance = self.state[index], self.covariance[index]
        new_state, new_covariance, shift, surprise = _corrected(
            state, covariance, information, vector, noise
        )
        turned = (surprise > _TURNED).nonzero()[0]
        if turned.size:
            self.streak[index[turned]] = 0
            variance, step = speed_sd * speed_sd, self.predicted_s[index[turned]]
            P = covariance[turned]
            for k in (0, 1):
                P[:, k, k] += variance * step * step
                P[:, k, k + 2] += variance * step
                P[:, k + 2, k] += variance * step
                P[:, k + 2, k + 2] += variance
            new_state[turned], new_covariance[turned], shift[turned], _ = _corrected(
                state[turned], P, information[turned], vector[turned], noise[turned]
            )
        self.state[index], self.covariance[index] = new_state, new_covariance
        self.shift_m[index] = shift

    def add(
        self, z: Array, covariance: Array, time_s: Array, rms_m: Array, speed_sd: float
    ) -> None:
        """Add tracks at rest from measured circles (j, 3) and their covariances (j, 3, 3)."""
        j = z.shape[0]
        state = np.zeros((j, 5))
        state[:, _Z] = z
        P = np.zeros((j, 5, 5))
        P[:, _Z[:, None], _Z[None, :]] = covariance
        P[:, VX, VX] = P[:, VY, VY] = speed_sd * speed_sd
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
            "shift_m": np.zeros((j, 2)),
        }
        for name in self._ARRAYS:
            setattr(self, name, np.concatenate((getattr(self, name), new[name])))


def _corrected(
    state: Array, covariance: Array, information: Array, vector: Array, noise: Array
) -> tuple[Array, Array, Array, Array]:
    """Posterior states and covariances, errors of the centres, and the corrections' lengths.

    With the information L and l = L z of a measurement of the part z of the state, and further
    noise N of it, x' = x + P_z S (l - L x_z) and P' = P - P_z S L P_z^T where
    S = (I + L (P_zz + N))^-1. L may be singular: what the scan does not show stays as it was.
    Of the difference, N S (l - L x_z) is that error. The lengths are squared Mahalanobis ones.
    """
    columns = covariance[:, :, _Z]
    total = sm.product(information, columns[:, _Z, :] + noise)
    total += _EYE
    weighted = np.empty((state.shape[0], 3, 4))  # L and l - L x_z side by side
    weighted[:, :, :3] = information
    weighted[:, :, 3] = vector - sm.applied(information, state[:, _Z])
    weighted = sm.product(sm.inverse(total), weighted)
    y = weighted[:, :, 3]
    gain = sm.product(columns, weighted)
    shift = gain[:, :, 3]
    changed = state + shift
    np.maximum(changed[:, RADIUS], 0.01, out=changed[:, RADIUS])
    moved = shift[:, _Z] * y
    surprise: Array = moved[:, 0] + moved[:, 1] + moved[:, 2]
    reduced = covariance - sm.product(gain[:, :, :3], columns.transpose(0, 2, 1))
    reduced += reduced.transpose(0, 2, 1).copy()
    reduced *= 0.5
    error = noise[:, :2, 0] * y[:, 0, None] + noise[:, :2, 1] * y[:, 1, None]
    return changed, reduced, error, surprise
