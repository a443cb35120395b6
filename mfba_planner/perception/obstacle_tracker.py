# SPDX-License-Identifier: Apache-2.0
"""Obstacle tracker: circles of any size, at rest or moving, and walls, from laser scans."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point, Pose2D
from ..core.planner_types import NANO, Circle, Scan
from .circle_fit import Fit, fit
from .free_space import FreeSpace
from .group_outline import Outline, outline_of, thinned
from .pose_error import PoseError
from .scan_beams import BeamReader, Beams
from .scan_segments import Segments, segments, taken_from_a_gap
from .track_association import NONE, associate, expected_labels
from .track_bank import RADIUS, VX, VY, TrackBank
from .track_lifecycle import drop_lost, fragments, judge_motion
from .tracking_params import TrackingParams

__all__ = ["Track", "Tracker", "TrackingParams"]

Array = np.ndarray

_MAX_ENLARGEMENT_M = 0.15  # for the uncertainty of a circle
_MOST_SPEED_SD = 0.5  # m/s, of it
_FAR_M, _DRIFT_MPS = 5.0, 0.02  # apparent speed of what stands so far away
_FEWEST_SCANS, _MOST_SCANS = 6, 30  # whose errors tell a common motion of all tracks
_SETTLED = 2  # scans of a track that may be an anchor
_ROUND_SCANS, _ROUND_SD_M = 5, 0.03  # from which a track's circle is known
_TURN_SHARE = 0.8  # of a step, by which an obstacle that turns back is found elsewhere
_NEAR_M, _NEAR_ROUND_M = 0.1, 0.04  # returns so near to a predicted circle are its own
_KNOWN = 3  # scans after which a track's velocity is known
_MAY_MOVE = 4.0  # squared significance of a velocity that may be one
_LEARNT = 6  # scans from which the errors of poses are known
_ANCHORS = 3  # such tracks tell that there is no common motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """One tracked obstacle at the time of the last scan; at rest its velocity is 0."""

    center_m: Point
    radius_m: float
    velocity_mps: Point
    position_sd_m: float
    velocity_sd_mps: float
    moving: bool
    unseen_s: float


class Tracker:
    """Tracks circles of unknown size; surfaces that are no circles become points at rest.

    A scan is cut into segments, these are given to the predicted tracks, and each group is
    fitted by a circle (circle_fit.py) that updates its track (track_bank.py) or starts one.
    Errors of the odometry are estimated from all tracks together (pose_error.py). A track moves
    if its velocity is significant and its outline is seen whole, or if it has entered space that
    was seen free (free_space.py); otherwise it stands, and its velocity is 0.
    """

    def __init__(self, params: TrackingParams | None = None) -> None:
        """Start without tracks."""
        self.params = params or TrackingParams()
        self._reader = BeamReader()
        self.beams: Beams | None = None  # of the last scan
        self._stamp_ns: int | None = None
        self._pose = Pose2D(0.0, 0.0)
        self._clear()

    def _clear(self) -> None:
        self._bank = TrackBank()
        self._pose_error = PoseError()
        self._free = FreeSpace()
        self._walls: list[Point] = []
        self._scans = 0
        self._range_variance = self.params.range_sd_m**2

    @property
    def tracks(self) -> tuple[Track, ...]:
        """All tracks, in the order of their start."""
        return tuple(
            Track(
                center_m=(x, y),
                radius_m=r,
                velocity_mps=(vx, vy) if moving else (0.0, 0.0),
                position_sd_m=position_sd,
                velocity_sd_mps=velocity_sd,
                moving=moving,
                unseen_s=unseen,
            )
            for (x, y, r, vx, vy), position_sd, velocity_sd, moving, unseen in zip(
                self._bank.state.T.tolist(),
                self._bank.position_sd_m.tolist(),
                self._bank.speed_sd_mps.tolist(),
                self._bank.moving.tolist(),
                self._bank.unseen_s.tolist(),
            )
        )

    def update(self, stamp_ns: int, pose: Pose2D, scan: Scan) -> None:
        """Update by a scan in a frame aligned with odom, taken from the pose at the stamp.

        An older stamp drops all tracks, an equal one is ignored.
        """
        dt = 0.0
        velocity = (0.0, 0.0, 0.0)
        if self._stamp_ns is not None:
            dt = (stamp_ns - self._stamp_ns) * NANO
            if dt == 0.0:
                return
            if dt < 0.0:
                self._clear()
                dt = 0.0
            else:
                last = self._pose
                turn = math.remainder(pose.yaw - last.yaw, 2.0 * math.pi)
                velocity = ((pose.x - last.x) / dt, (pose.y - last.y) / dt, turn / dt)
        self._stamp_ns, self._pose = stamp_ns, pose
        p, bank = self.params, self._bank
        self.beams = beams = self._reader.read(pose, velocity, scan)
        origin = pose.position
        bank.pass_time(dt)
        self._free.pass_time(dt)
        bank.predict(self._expected_times(beams, origin), p.acceleration_sd)
        sd = np.minimum(bank.position_sd_m + self._pose_sd(origin, bank.state), 1.0)
        found, off = self._segments(beams, sd)
        vx, vy = bank.state[VX:]
        turned_m = _TURN_SHARE * dt * np.sqrt(vx * vx + vy * vy)
        track = associate(found, off, origin, bank.state, sd, p.gate_m + turned_m)
        self._use(beams, found, track, origin)
        self._follow_odometry(dt, origin)
        self._free.add(beams, self._pose_error.error, self._pose_error.sd_rad)

    def _follow_odometry(self, dt: float, origin: Point) -> None:
        """Move the tracks towards the odometry, whose errors have the mean 0.

        Nothing but that tells whether all obstacles turn around the robot. The gains are those
        of a least-squares line through the errors of the last scans.
        """
        self._scans += 1
        bank, error = self._bank, self._pose_error
        if dt <= 0.0 or not bank.count or error.error == (0.0, 0.0, 0.0):
            return
        anchors = int(np.count_nonzero(~bank.moving & (bank.scans >= _SETTLED)))
        # After n scans the rate of turn is known to 3.5 sd / (dt n^1.5).
        noise = 3.5 * max(error.sd_m / _FAR_M, error.sd_rad) * _FAR_M / (dt * _DRIFT_MPS)
        n = int(min(max(noise ** (2.0 / 3.0), _FEWEST_SCANS), _MOST_SCANS))
        if anchors < _ANCHORS:
            n = max(_FEWEST_SCANS, min(n, self._scans))
        gain, rate = 2.0 * (2 * n - 1) / (n * (n + 1)), 6.0 / (n * (n + 1) * dt)
        x, y, turn = error.error
        bank.turn_with(error.follow(gain), (rate * x, rate * y, rate * turn), origin)

    def circles(self, now_ns: int, robot_radius_m: float) -> tuple[Circle, ...]:
        """The tracked circles, predicted to now_ns and enlarged by the robot's radius.

        They are relative to the pose that was given with the last scan, error included: the
        planner knows no other.
        """
        bank, p = self._bank, self.params
        circles: list[Circle] = []
        if bank.count:
            ahead_s = (now_ns - (self._stamp_ns or now_ns)) * NANO
            moving = bank.moving
            x, y, r = bank.state[:VX]
            vx, vy = np.where(moving, bank.state[VX:], 0.0)
            ahead = ahead_s - bank.time_s
            shift_x, shift_y = self._pose_error.shift(x, y, self._pose.position)
            x = x + shift_x + bank.shift_m[0] + vx * ahead
            y = y + shift_y + bank.shift_m[1] + vy * ahead
            speed_sd, noise_m = bank.speed_sd_mps, math.sqrt(self._range_variance)
            enlargement = (
                p.allowance_m
                + p.noise_factor * noise_m
                + p.position_sd_factor * bank.position_sd_m
                + p.speed_sd_factor_s * np.minimum(speed_sd, _MOST_SPEED_SD)
                + np.maximum(bank.rms_m - noise_m, 0.0)
            )
            r = r + np.minimum(enlargement, _MAX_ENLARGEMENT_M) + robot_radius_m
            circles = [
                Circle(
                    center_m=(cx, cy),
                    radius_m=cr,
                    velocity_mps=(cvx, cvy),
                    velocity_sd_mps=sd,
                )
                for cx, cy, cr, cvx, cvy, sd in np.array((x, y, r, vx, vy, speed_sd)).T.tolist()
            ]
        radius = robot_radius_m + p.allowance_m
        circles += [Circle(center_m=point, radius_m=radius) for point in self._walls]
        return tuple(circles)

    @property
    def pose_error(self) -> tuple[float, float, float]:
        """Error (x, y, turn) of the pose of the last scan, as far as it is known."""
        return self._pose_error.error

    @property
    def pose_variance(self) -> tuple[float, float]:
        """Variances of single poses, per axis (m^2) and of the heading (rad^2); 0: not learnt."""
        e = self._pose_error
        return (e.variance_m2, e.variance_rad2) if e.learnt >= _LEARNT else (0.0, 0.0)

    @property
    def radii_m(self) -> Array:
        """Radii of the tracks (m,), not enlarged; circles() begins with them."""
        radii: Array = self._bank.state[RADIUS]
        return radii

    def may_move(self) -> Array:
        """Whether each of the tracks moves or may move; (m,)."""
        bank = self._bank
        vx, vy = bank.state[VX], bank.state[VY]
        speed2 = vx * vx + vy * vy
        variance = 0.5 * (bank.covariance[VX, VX] + bank.covariance[VY, VY])
        may: Array = bank.moving | ((speed2 > _MAY_MOVE * variance) & (bank.scans > 1))
        return may

    def moving(self) -> tuple[Array, Array]:
        """Tracks that move or may move, by the pose of the last scan.

        Rows (x, y, vx, vy, r) (m, 5), and whether it is sure that each moves (m,).
        """
        bank, may = self._bank, self.may_move()
        x, y, r, vx, vy = bank.state[:, may]
        shift_x, shift_y = self._pose_error.shift(x, y, self._pose.position)
        return np.stack((x + shift_x, y + shift_y, vx, vy, r), axis=1), bank.moving[may]

    def _expected_times(self, beams: Beams, origin: Point) -> Array:
        """When the beams meet each track, s after the stamp; (m,)."""
        bank = self._bank
        if not (bank.count and beams.time_s.size and beams.time_s.any()):
            return np.zeros(bank.count)
        bearing = np.arctan2(bank.state[1] - origin[1], bank.state[0] - origin[0])
        index = np.clip(beams.index_of(bearing), 0, beams.count - 1)
        time_s = np.zeros(beams.count)
        time_s[beams.number] = beams.time_s
        times: Array = time_s[index]
        return times

    def _pose_sd(self, origin: Point, state: Array) -> Array:
        """Standard deviation of the tracks' measured places by errors of the odometry; (m,)."""
        dx, dy = state[0] - origin[0], state[1] - origin[1]
        e = self._pose_error
        sd: Array = np.sqrt(e.variance_m2 + e.variance_rad2 * (dx * dx + dy * dy))
        return sd

    def _segments(self, beams: Beams, sd: Array) -> tuple[Segments, Array]:
        """The scan's segments and the distances (k, m) of its returns from the tracks."""
        taken = taken_from_a_gap(beams)
        r = beams.range_m.take(taken)
        xy = np.array((beams.cos.take(taken), beams.sin.take(taken)))
        xy *= r
        xy[0] += beams.origin_x.take(taken)
        xy[1] += beams.origin_y.take(taken)
        bank, noise = self._bank, math.sqrt(self._range_variance)
        join, hump = self.params.join_m + 3.0 * noise, self.params.hump_m + 2.5 * noise
        radius_sd = np.sqrt(bank.covariance[RADIUS, RADIUS])
        round_ = (bank.scans >= _ROUND_SCANS) & (radius_sd < _ROUND_SD_M)
        # What comes out from behind a known circle must not be taken for its growth.
        near = np.where(round_, _NEAR_ROUND_M + 2.0 * noise + sd, _NEAR_M)
        label, off = expected_labels(xy, bank.state, near + np.minimum(sd, 0.2))
        return segments(beams, taken, xy, label, round_, join, hump), off

    def _use(self, beams: Beams, found: Segments, track: Array, origin: Point) -> None:
        """Fit the groups, and update, start and drop tracks by them."""
        bank, p = self._bank, self.params
        is_new = track == NONE
        is_matched = np.zeros(bank.count, dtype=bool)
        is_matched[track[~is_new]] = True
        known = is_matched.nonzero()[0]
        groups = known.size + int(np.count_nonzero(is_new))
        group = np.empty(track.size, dtype=np.int64)
        if known.size:
            group = (np.add.accumulate(is_matched, dtype=np.int64) - 1).take(track)
        group[is_new] = np.arange(known.size, groups)
        self._walls = []
        updated = np.zeros(bank.count, dtype=bool)
        if groups:
            radius = np.full(groups, p.radius_m)
            variance = np.full(groups, p.radius_sd_m**2)
            radius[: known.size] = bank.state[RADIUS, known]
            variance[: known.size] = bank.covariance[RADIUS, RADIUS, known] + 0.03**2
            outline = outline_of(beams, found, group, groups, radius)
            fitted = fit(outline.returns, outline.start, radius, variance, self._range_variance)
            wall = self._is_wall(fitted, outline)
            round_ = ~wall
            of_known = round_[: known.size].nonzero()[0]
            index = known[of_known]
            self._correct(index, of_known, fitted, origin)
            updated[index] = True
            self._learn_noise(fitted, outline, round_)
            noise = math.sqrt(self._range_variance)
            judge_motion(bank, index, of_known, fitted, outline, noise, self._appeared)
            new = round_[known.size :].nonzero()[0] + known.size
            if new.size:
                new = new[~fragments(new, fitted, outline, wall, noise)]
                self._start(new, fitted, outline, origin)
            if wall.any():
                self._walls = thinned(found, wall[group[found.segment]])
        drop_lost(bank, beams, origin, updated, self._pose_sd(origin, bank.state), p)

    def _is_wall(self, fitted: Fit, outline: Outline) -> Array:
        """Groups that are no circles: too wide, or far from round; (g,)."""
        limit = 0.06 + 3.0 * math.sqrt(self._range_variance)
        wall: Array = (
            (fitted.z[RADIUS] > self.params.widest_m)
            | (outline.width_m > 2.0 * self.params.widest_m)
            | (fitted.rms_m > limit)
        )
        return wall

    def _correct(self, index: Array, group: Array, fitted: Fit, origin: Point) -> None:
        """Update tracks by their groups, less the error of the odometry."""
        bank, error = self._bank, self._pose_error
        measured = fitted.z[:2].take(group, axis=1)
        predicted, covariance = bank.expected(index)
        covariance += fitted.covariance[:2, :2, group]
        settled = bank.scans[index] >= _KNOWN
        left = error.estimate(measured, predicted, covariance, settled, origin)
        if not index.size:
            return
        sx, sy = error.shift(measured[0], measured[1], origin)
        information = fitted.information.take(group, axis=2)
        vector = fitted.vector.take(group, axis=1)
        vector -= information[:, 0] * sx + information[:, 1] * sy
        noise = error.noise(measured, left, origin)
        bank.update(index, information, vector, noise, self.params.speed_sd_mps)
        bank.known_s[index] += bank.unseen_s[index]
        bank.unseen_s[index] = bank.predicted_s[index] = 0.0
        bank.scans[index] += 1
        bank.rms_m[index] = fitted.rms_m[group]
        bank.missed[index] = 0

    def _learn_noise(self, fitted: Fit, outline: Outline, round_: Array) -> None:
        """Learn the range's variance from the residuals of groups of many returns."""
        count = outline.returns.count
        many = (round_ & (count >= 6.0) & outline.whole).nonzero()[0]
        if many.size:
            n = count[many]
            samples = fitted.rms_m[many] ** 2 * n / (n - 3.0)
            samples.sort()
            sample = float(samples[many.size // 2])
            low, high = self.params.range_sd_m**2, 0.05**2
            learnt = self._range_variance + 0.1 * (sample - self._range_variance)
            self._range_variance = min(max(learnt, low), high)

    def _appeared(self, x: Array, y: Array) -> Array:
        """Whether returns (k,) of the present scan lie in space that was seen free."""
        error = self._pose_error
        sx, sy = error.shift(x, y, self._pose.position)
        margin = 3.0 * math.sqrt(self._range_variance) + 2.0 * error.sd_m
        return self._free.appeared(x - sx, y - sy, margin)

    def _start(self, group: Array, fitted: Fit, outline: Outline, origin: Point) -> None:
        """Start a track for each of these groups."""
        if not group.size:
            return
        z = fitted.z.take(group, axis=1)
        z[:2] -= self._pose_error.shift(z[0], z[1], origin)
        self._bank.add(
            z, fitted.covariance.take(group, axis=2), outline.time_s[group], fitted.rms_m[group],
            self.params.speed_sd_mps,
        )  # fmt: skip
