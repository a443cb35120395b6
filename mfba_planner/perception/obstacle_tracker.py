# SPDX-License-Identifier: Apache-2.0
"""Moving circles from successive scans: an extended Kalman filter each, no ground truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point, Pose2D
from ..core.options import check, option
from ..core.types import NANO, Circle, Scan

Array = np.ndarray

_TAKEN = 6  # returns of a scan that update a track, spread over it
_MISSES = 2  # beams
_DOUBT_M = 0.15  # no circle is enlarged by more


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingParams:
    """What is assumed of obstacles before they are seen, and of the sensor."""

    radius_m: float = option(0.3, "expected radius", unit="m", minimum=0.01, maximum=10.0)
    radius_sd_m: float = option(0.03, "its deviation", unit="m", minimum=1e-6, maximum=10.0)
    speed_sd_mps: float = option(
        0.2, "deviation of a new obstacle's velocity, per axis", unit="m/s", minimum=1e-3,
        maximum=100.0,
    )  # fmt: skip
    position_sd_m: float = option(
        0.1, "deviation of a new obstacle's centre", unit="m", minimum=1e-3, maximum=10.0
    )
    range_sd_m: float = option(0.01, "noise of a range", unit="m", minimum=1e-4, maximum=10.0)
    turning_mps2: float = option(
        0.05, "white acceleration", unit="m/s^2", minimum=0.0, maximum=100.0
    )
    gate_m: float = option(
        0.25, "farthest a return may lie off its circle", unit="m", minimum=0.01, maximum=10.0
    )
    join_m: float = option(
        0.35, "distance at which returns belong together", unit="m", minimum=0.01, maximum=10.0
    )
    widest_m: float = option(
        1.3, "width beyond which a shape is no circle", unit="m", minimum=0.01, maximum=100.0
    )
    position_sd_factor: float = option(
        0.5, "deviations of the centre by which a circle is enlarged", minimum=0.0, maximum=10.0
    )
    speed_sd_factor_s: float = option(
        0.1, "time for which a velocity's deviation enlarges it", unit="s", minimum=0.0,
        maximum=10.0,
    )  # fmt: skip
    allowance_m: float = option(
        0.01, "by which every tracked circle is enlarged", unit="m", minimum=0.0, maximum=1.0
    )
    forget_s: float = option(
        2.0, "time after which an unseen obstacle is given up", unit="s", minimum=0.0,
        maximum=100.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class Track:
    """One obstacle: state x, y, vx, vy, r and its covariance, at the tracker's time.

    Plain floats, one number measured after the other: nothing here is a matrix worth a library,
    and the same bits come out everywhere.
    """

    __slots__ = ("covariance", "seen_ns", "state")

    def __init__(self, state: list[float], deviations: list[float], seen_ns: int) -> None:
        """Start from independent deviations."""
        self.state = state
        self.covariance = [
            [deviation * deviation if i == j else 0.0 for j in range(5)]
            for i, deviation in enumerate(deviations)
        ]
        self.seen_ns = seen_ns

    def predict(self, dt: float, acceleration: float) -> None:
        """Move on for dt seconds at constant velocity, shaken by a white acceleration."""
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

    def uncertainty(self) -> tuple[float, float]:
        """Deviations of the centre (m) and of the velocity (m/s), the mean of the axes."""
        P = self.covariance
        return math.sqrt(0.5 * (P[0][0] + P[1][1])), math.sqrt(0.5 * (P[2][2] + P[3][3]))

    def measure(self, hx: float, hy: float, hr: float, residual: float, variance: float) -> float:
        """A scalar with gradient (hx, hy, 0, 0, hr); returns the squared surprise in sigmas."""
        P = self.covariance
        spread = [row[0] * hx + row[1] * hy + row[4] * hr for row in P]
        total = spread[0] * hx + spread[1] * hy + spread[4] * hr + variance
        share = residual / total
        self.state = [x + s * share for x, s in zip(self.state, spread)]
        self.covariance = [
            [p - si * sj / total for p, sj in zip(row, spread)] for row, si in zip(P, spread)
        ]
        return residual * share

    def touch(self, px: float, py: float, variance: float) -> float:
        """The point lies on the circle: |p - c| - r = 0."""
        x, y, _, _, r = self.state
        dx, dy = px - x, py - y
        away = math.sqrt(dx * dx + dy * dy) or 1e-9
        return self.measure(dx / away, dy / away, 1.0, away - r, variance)

    def passed(self, ox: float, oy: float, ux: float, uy: float, variance: float) -> float:
        """The beam from o along the unit u passes the circle: |u x (c - o)| - r >= 0."""
        x, y, _, _, r = self.state
        across = ux * (y - oy) - uy * (x - ox)
        inside = r - abs(across)
        if inside <= 0.0:
            return 0.0
        side = -1.0 if across < 0.0 else 1.0
        return self.measure(-side * uy, side * ux, -1.0, inside, variance)


class Tracker:
    """Circles that explain the scans so far; returns of wide shapes are points at rest.

    A return on a track's circle updates it, as does a beam that ought to have met the circle
    and did not; other returns that lie together begin a new track.
    """

    def __init__(self, params: TrackingParams | None = None) -> None:
        """Start without any track."""
        self.params = params or TrackingParams()
        self.tracks: list[Track] = []
        self._points: list[Point] = []
        self._stamp_ns: int | None = None

    def update(self, stamp_ns: int, pose: Pose2D, scan: Scan) -> None:
        """Take a scan of that stamp and pose; an older or equal stamp begins anew."""
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
        owner = self._owners(points)
        for number, track in enumerate(self.tracks):
            mine = points[owner == number]
            if len(mine):
                track.seen_ns = stamp_ns
            self._correct(track, mine, pose, free, scan.range_max_m)
        self._begin(points[owner < 0], pose, stamp_ns)
        self.tracks = [t for t in self.tracks if self._alive(t, stamp_ns)]

    def circles(self, now_ns: int, robot_radius_m: float) -> tuple[Circle, ...]:
        """What is tracked, moved on to now and enlarged by the robot."""
        ahead_s = (now_ns - (self._stamp_ns or now_ns)) * NANO
        p, found = self.params, []
        for track in self.tracks:
            x, y, vx, vy, r = track.state
            place, speed = track.uncertainty()
            uncertainty = (
                p.allowance_m + p.position_sd_factor * place + p.speed_sd_factor_s * speed
            )
            found.append(
                Circle(
                    center_m=(x + vx * ahead_s, y + vy * ahead_s),
                    radius_m=r + robot_radius_m + min(uncertainty, _DOUBT_M),
                    velocity_mps=(vx, vy),
                )
            )
        found += [Circle(center_m=point, radius_m=robot_radius_m) for point in self._points]
        return tuple(found)

    def _owners(self, points: Array) -> Array:
        """Number of the track each point lies on, -1 for none; (k,)."""
        if not self.tracks or not len(points):
            return np.full(len(points), -1)
        states = np.array([track.state for track in self.tracks])
        off = points[:, None, :] - states[None, :, :2]
        residual = np.abs(np.hypot(off[..., 0], off[..., 1]) - states[:, 4])
        owner = residual.argmin(axis=1)
        far = residual[np.arange(len(points)), owner] > self.params.gate_m
        owner[far] = -1
        return owner

    def _correct(
        self, track: Track, points: Array, pose: Pose2D, free: Array, longest_m: float
    ) -> None:
        """Take the returns of a track and the beams that ought to have met it."""
        p = self.params
        count = min(len(points), _TAKEN)
        taken = points[np.linspace(0, len(points) - 1, count).round().astype(int)].tolist()
        beams = self._missed(track, pose, free, longest_m)
        before = track.state, track.covariance
        variance = p.range_sd_m**2 * max(1.0, count / max(len(points), 1))
        for again in (False, True):
            surprise = 0.0
            for px, py in taken:
                surprise += track.touch(px, py, variance)
            for ux, uy in beams:
                surprise += track.passed(pose.x, pose.y, ux, uy, variance)
            if again or surprise <= 9.0 + 3.0 * (count + len(beams)):
                return
            # It has turned: its velocity is unknown again.
            track.state, covariance = before
            track.covariance = [list(row) for row in covariance]
            for axis in (2, 3):
                track.covariance[axis][axis] += p.speed_sd_mps**2
            for axis in (0, 1):
                track.covariance[axis][axis] += p.range_sd_m**2

    @staticmethod
    def _missed(
        track: Track, pose: Pose2D, free: Array, longest_m: float
    ) -> list[tuple[float, float]]:
        """Free beams through the circle's middle, deepest first, a few."""
        x, y, _, _, r = track.state
        ox, oy = x - pose.x, y - pose.y
        if not len(free) or math.sqrt(ox * ox + oy * oy) <= r:
            return []
        along = free[:, 0] * ox + free[:, 1] * oy
        across = np.abs(free[:, 0] * oy - free[:, 1] * ox)
        depth = np.sqrt(np.maximum(r * r - across * across, 0.0))
        met = np.flatnonzero((across < r) & (along > 0.0) & (along - depth < longest_m))
        deepest = met[np.argsort(across[met], kind="stable")[:_MISSES]]
        return [(ux, uy) for ux, uy in free[deepest].tolist()]

    def _begin(self, points: Array, pose: Pose2D, stamp_ns: int) -> None:
        """A new track for returns that lie together, points at rest for those too far apart."""
        if not len(points):
            return
        p = self.params
        step = np.roll(points, -1, axis=0) - points
        cuts = np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) > p.join_m) + 1
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
            away = math.sqrt(ux * ux + uy * uy) or 1e-9
            mx, my = middle.tolist()
            r = p.radius_m
            place, speed = p.position_sd_m, p.speed_sd_mps
            track = Track(
                [mx + ux / away * r, my + uy / away * r, 0.0, 0.0, r],
                [place, place, speed, speed, p.radius_sd_m],
                stamp_ns,
            )
            self._correct(track, group, pose, np.empty((0, 2)), math.inf)
            self.tracks.append(track)

    def _alive(self, track: Track, stamp_ns: int) -> bool:
        p = self.params
        unseen_s = (stamp_ns - track.seen_ns) * NANO
        vague = track.covariance[0][0] + track.covariance[1][1] > 0.25
        return unseen_s <= p.forget_s and not vague and track.state[4] > 0.0
