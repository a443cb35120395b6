# SPDX-License-Identifier: Apache-2.0
"""Obstacle tracker: moving circles from laser scans, one extended Kalman filter each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point, Pose2D
from ..core.option_specs import check, option
from ..core.planner_types import NANO, Circle, Scan

Array = np.ndarray

_MAX_HITS = 6  # returns of a scan that update a track, evenly spaced
_MAX_MISSES = 2  # beams through a circle without a return that update its track
_MAX_ENLARGEMENT_M = 0.15  # for the uncertainty of a circle


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingParams:
    """Prior of a new obstacle, noise of the sensor, and limits of the association."""

    radius_m: float = option(0.3, "expected radius", unit="m", minimum=0.01, maximum=10.0)
    radius_sd_m: float = option(
        0.03, "standard deviation of the radius", unit="m", minimum=1e-6, maximum=10.0
    )
    speed_sd_mps: float = option(
        0.2, "standard deviation of a new obstacle's velocity, per axis", unit="m/s", minimum=1e-3,
        maximum=100.0,
    )  # fmt: skip
    position_sd_m: float = option(
        0.1,
        "standard deviation of a new obstacle's centre",
        unit="m",
        minimum=1e-3,
        maximum=10.0,
    )
    range_sd_m: float = option(
        0.01, "standard deviation of a range", unit="m", minimum=1e-4, maximum=10.0
    )
    turning_mps2: float = option(
        0.05, "white-noise acceleration", unit="m/s^2", minimum=0.0, maximum=100.0
    )
    gate_m: float = option(
        0.25, "largest distance of a return from its circle", unit="m", minimum=0.01, maximum=10.0
    )
    join_m: float = option(
        0.35,
        "largest distance of neighbouring returns of one obstacle",
        unit="m",
        minimum=0.01,
        maximum=10.0,
    )
    widest_m: float = option(
        1.3,
        "width above which a group of returns is no circle",
        unit="m",
        minimum=0.01,
        maximum=100.0,
    )
    position_sd_factor: float = option(
        0.5,
        "standard deviations of the centre by which a circle is enlarged",
        minimum=0.0,
        maximum=10.0,
    )
    speed_sd_factor_s: float = option(
        0.1, "time for which the velocity's standard deviation enlarges it", unit="s", minimum=0.0,
        maximum=10.0,
    )  # fmt: skip
    allowance_m: float = option(
        0.01, "enlargement of every tracked circle", unit="m", minimum=0.0, maximum=1.0
    )
    forget_s: float = option(
        2.0, "time without a return after which a track is dropped", unit="s", minimum=0.0,
        maximum=100.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class Track:
    """One obstacle: state x, y, vx, vy, r and its covariance, at the tracker's time.

    Plain floats and scalar measurements, one after the other: the matrices are small, and the
    result is the same bit by bit on every machine.
    """

    __slots__ = ("covariance", "observed_ns", "state")

    def __init__(self, state: list[float], deviations: list[float], observed_ns: int) -> None:
        """Start from independent standard deviations of the five states."""
        self.state = state
        self.covariance = [
            [deviation * deviation if i == j else 0.0 for j in range(5)]
            for i, deviation in enumerate(deviations)
        ]
        self.observed_ns = observed_ns

    def predict(self, dt: float, acceleration: float) -> None:
        """Predict by dt seconds: constant velocity with white-noise acceleration."""
        x, P = self.state, self.covariance
        x[0] += x[2] * dt
        x[1] += x[3] * dt
        for k in (0, 1):
            for j in range(5):
                P[k][j] += dt * P[k + 2][j]
            for j in range(5):
                P[j][k] += dt * P[j][k + 2]
        q = acceleration * acceleration * dt
        for k in (0, 1):
            P[k][k] += q * dt * dt / 3.0
            P[k + 2][k + 2] += q

    def deviations(self) -> tuple[float, float]:
        """Standard deviations of centre (m) and velocity (m/s), mean of both axes."""
        P = self.covariance
        return math.sqrt(0.5 * (P[0][0] + P[1][1])), math.sqrt(0.5 * (P[2][2] + P[3][3]))

    def update_scalar(
        self, hx: float, hy: float, hr: float, residual: float, variance: float
    ) -> float:
        """Update by a scalar with gradient (hx, hy, 0, 0, hr); its normalized innovation^2."""
        P = self.covariance
        spread = [row[0] * hx + row[1] * hy + row[4] * hr for row in P]
        total = spread[0] * hx + spread[1] * hy + spread[4] * hr + variance
        share = residual / total
        self.state = [x + s * share for x, s in zip(self.state, spread)]
        self.covariance = [
            [p - si * sj / total for p, sj in zip(row, spread)] for row, si in zip(P, spread)
        ]
        return residual * share

    def update_hit(self, px: float, py: float, variance: float) -> float:
        """Update by a return, a point p on the circle: |p - c| - r = 0."""
        x, y, _, _, r = self.state
        dx, dy = px - x, py - y
        distance_m = math.sqrt(dx * dx + dy * dy) or 1e-9
        return self.update_scalar(dx / distance_m, dy / distance_m, 1.0, distance_m - r, variance)

    def update_miss(self, ox: float, oy: float, ux: float, uy: float, variance: float) -> float:
        """Update by a beam from o along the unit vector u that missed: |u x (c - o)| - r >= 0."""
        x, y, _, _, r = self.state
        across = ux * (y - oy) - uy * (x - ox)
        inside = r - abs(across)
        if inside <= 0.0:
            return 0.0
        side = -1.0 if across < 0.0 else 1.0
        return self.update_scalar(-side * uy, side * ux, -1.0, inside, variance)


class Tracker:
    """Tracks moving circles; returns of shapes too wide for a circle become points at rest.

    A return on a track's circle updates the track, as does a beam through the circle without a
    return. Other returns close to each other start a new track.
    """

    def __init__(self, params: TrackingParams | None = None) -> None:
        """Start without tracks."""
        self.params = params or TrackingParams()
        self.tracks: list[Track] = []
        self._points: list[Point] = []
        self._stamp_ns: int | None = None

    def update(self, stamp_ns: int, pose: Pose2D, scan: Scan) -> None:
        """Update by a scan; an older stamp drops all tracks, an equal one is ignored."""
        if self._stamp_ns is not None and stamp_ns <= self._stamp_ns:
            if stamp_ns == self._stamp_ns:
                return
            self.tracks = []
        elif self._stamp_ns is not None:
            for track in self.tracks:
                track.predict((stamp_ns - self._stamp_ns) * NANO, self.params.turning_mps2)
        self._stamp_ns = stamp_ns
        r = np.asarray(scan.ranges_m, dtype=np.float64)
        near = np.isneginf(r)
        hit = near | ((r >= scan.range_min_m) & (r <= scan.range_max_m))
        self._points = []
        if not (self.tracks or hit.any()):
            return
        angles = scan.angle_min_rad + scan.angle_increment_rad * np.arange(r.size)
        rays = np.column_stack((np.cos(angles), np.sin(angles)))
        origin = np.array(pose.position)
        reach = np.where(near, scan.range_min_m, r)[hit]
        points = origin + reach[:, None] * rays[hit]
        free = rays[np.isposinf(r)]
        track_of = self._associate(points)
        for number, track in enumerate(self.tracks):
            returns = points[track_of == number]
            if len(returns):
                track.observed_ns = stamp_ns
            self._correct(track, returns, pose, free, scan.range_max_m)
        self._start_tracks(points[track_of < 0], pose, stamp_ns)
        self.tracks = [t for t in self.tracks if self._is_kept(t, stamp_ns)]

    def circles(self, now_ns: int, robot_radius_m: float) -> tuple[Circle, ...]:
        """The tracked circles, predicted to now_ns and enlarged by the robot's radius."""
        ahead_s = (now_ns - (self._stamp_ns or now_ns)) * NANO
        p, found = self.params, []
        for track in self.tracks:
            x, y, vx, vy, r = track.state
            position_sd, speed_sd = track.deviations()
            enlargement = (
                p.allowance_m + p.position_sd_factor * position_sd + p.speed_sd_factor_s * speed_sd
            )
            found.append(
                Circle(
                    center_m=(x + vx * ahead_s, y + vy * ahead_s),
                    radius_m=r + robot_radius_m + min(enlargement, _MAX_ENLARGEMENT_M),
                    velocity_mps=(vx, vy),
                )
            )
        found += [Circle(center_m=point, radius_m=robot_radius_m) for point in self._points]
        return tuple(found)

    def _associate(self, points: Array) -> Array:
        """Index of the nearest track within gate_m for each point, -1 for none; (k,)."""
        if not self.tracks or not len(points):
            return np.full(len(points), -1)
        states = np.array([track.state for track in self.tracks])
        off = points[:, None, :] - states[None, :, :2]
        residual = np.abs(np.hypot(off[..., 0], off[..., 1]) - states[:, 4])
        track_of = residual.argmin(axis=1)
        far = residual[np.arange(len(points)), track_of] > self.params.gate_m
        track_of[far] = -1
        return track_of

    def _correct(
        self, track: Track, points: Array, pose: Pose2D, free: Array, longest_m: float
    ) -> None:
        """Update a track by its returns and by beams through it without a return."""
        p = self.params
        count = min(len(points), _MAX_HITS)
        taken = points[np.linspace(0, len(points) - 1, count).round().astype(int)].tolist()
        beams = self._beams_through(track, pose, free, longest_m)
        before = track.state, track.covariance
        variance = p.range_sd_m**2 * max(1.0, count / max(len(points), 1))
        for retry in (False, True):
            squared_innovation = 0.0
            for px, py in taken:
                squared_innovation += track.update_hit(px, py, variance)
            for ux, uy in beams:
                squared_innovation += track.update_miss(pose.x, pose.y, ux, uy, variance)
            if retry or squared_innovation <= 9.0 + 3.0 * (count + len(beams)):
                return
            # The obstacle has turned: its velocity is unknown again.
            track.state, covariance = before
            track.covariance = [list(row) for row in covariance]
            for axis in (2, 3):
                track.covariance[axis][axis] += p.speed_sd_mps**2
            for axis in (0, 1):
                track.covariance[axis][axis] += p.range_sd_m**2

    @staticmethod
    def _beams_through(
        track: Track, pose: Pose2D, free: Array, longest_m: float
    ) -> list[tuple[float, float]]:
        """A few free beams through the circle, those nearest to its centre first."""
        x, y, _, _, r = track.state
        ox, oy = x - pose.x, y - pose.y
        if not len(free) or math.sqrt(ox * ox + oy * oy) <= r:
            return []
        along = free[:, 0] * ox + free[:, 1] * oy
        across = np.abs(free[:, 0] * oy - free[:, 1] * ox)
        depth = np.sqrt(np.maximum(r * r - across * across, 0.0))
        through = np.flatnonzero((across < r) & (along > 0.0) & (along - depth < longest_m))
        deepest = through[np.argsort(across[through], kind="stable")[:_MAX_MISSES]]
        return [(ux, uy) for ux, uy in free[deepest].tolist()]

    def _start_tracks(self, points: Array, pose: Pose2D, stamp_ns: int) -> None:
        """A new track for each group of returns; points at rest for a group too wide."""
        if not len(points):
            return
        p = self.params
        difference = np.roll(points, -1, axis=0) - points
        cuts = np.flatnonzero(np.hypot(difference[:, 0], difference[:, 1]) > p.join_m) + 1
        if len(cuts):
            points = np.roll(points, -cuts[0], axis=0)
            groups = np.split(points, cuts[1:] - cuts[0])
        else:
            groups = [points]
        for group in groups:
            if math.dist(group[0], group[-1]) > p.widest_m:
                self._points += [(x, y) for x, y in group.tolist()]
                continue
            middle = group.mean(axis=0)
            ux, uy = (middle - np.array(pose.position)).tolist()
            distance_m = math.sqrt(ux * ux + uy * uy) or 1e-9
            mx, my = middle.tolist()
            r = p.radius_m
            position_sd, speed_sd = p.position_sd_m, p.speed_sd_mps
            track = Track(
                [mx + ux / distance_m * r, my + uy / distance_m * r, 0.0, 0.0, r],
                [position_sd, position_sd, speed_sd, speed_sd, p.radius_sd_m],
                stamp_ns,
            )
            self._correct(track, group, pose, np.empty((0, 2)), math.inf)
            self.tracks.append(track)

    def _is_kept(self, track: Track, stamp_ns: int) -> bool:
        p = self.params
        unobserved_s = (stamp_ns - track.observed_ns) * NANO
        too_uncertain = track.covariance[0][0] + track.covariance[1][1] > 0.25
        return unobserved_s <= p.forget_s and not too_uncertain and track.state[4] > 0.0
