# SPDX-License-Identifier: Apache-2.0
"""Obstacle tracker: circles of any size, at rest or moving, and walls, from laser scans."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point, Pose2D
from ..core.planner_types import NANO, Circle, Scan
from .circle_fit import Fit, Returns, fit, start_of
from .free_space import FreeSpace
from .pose_error import PoseError
from .scan_beams import BeamReader, Beams
from .scan_segments import Segments, segments, taken_from_a_gap
from .track_association import NONE, associate, expected_labels
from .track_bank import RADIUS, VX, VY, TrackBank
from .tracking_params import TrackingParams

__all__ = ["Track", "Tracker", "TrackingParams"]

Array = np.ndarray

_MAX_ENLARGEMENT_M = 0.15  # for the uncertainty of a circle
_MOST_SPEED_SD = 0.5  # m/s, of it
_MOVES, _RESTS = 12.0, 4.0  # squared significances of a velocity: begins to move, is at rest
_LEAST_SPEED = 0.03  # m/s; slower counts as at rest
_APPEARED_S = 1.0  # for so long after returns in free space a velocity is believed
_POINT_SPACING_M = 0.08  # between points of a wall
_SEES_PAST_M = 0.15  # beams that end so much behind a circle have seen through it
_MOST_MISSED = 2  # scans in a row that see through a track before it is dropped
_NEW_S = 0.25  # a track is kept so long without a return, and as long again as it was seen
_LOST_VARIANCE = 0.25  # m^2, of a centre too uncertain to keep
_FAR_M, _DRIFT_MPS = 5.0, 0.02  # apparent speed of what stands so far away
_FEWEST_SCANS, _MOST_SCANS = 6, 30  # whose errors tell a common motion of all tracks
_SETTLED = 2  # scans of a track that may be an anchor
_ROUND_SCANS, _ROUND_SD_M = 5, 0.03  # from which a track's circle is known
_KNOWN = 3  # scans after which a track's velocity is known
_ANCHORS = 3  # such tracks tell that there is no common motion
_FRAGMENT_M = 0.05
RADIUS_OF_FIT = 2


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
        self._stamp_ns: int | None = None
        self._pose = Pose2D(0.0, 0.0)
        self._clear()

    def _clear(self) -> None:
        self._bank = TrackBank()
        self._pose_error = PoseError()
        self._free = FreeSpace()
        self._walls: list[Point] = []
        self._scans = 0
        self._clean = {}
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
            for (x, y, vx, vy, r), position_sd, velocity_sd, moving, unseen in zip(
                self._bank.state.tolist(),
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
        beams = self._reader.read(pose, velocity, scan)
        origin = np.array(pose.position)
        bank.pass_time(dt)
        self._free.pass_time(dt)
        bank.predict(self._expected_times(beams, origin), p.acceleration_sd)
        sd = np.minimum(bank.position_sd_m + self._pose_sd(origin, bank.state), 1.0)
        found, off = self._segments(beams, sd)
        track = associate(found, off, origin, bank.state, sd, p.gate_m)
        self._use(beams, found, track, origin)
        self._follow_odometry(dt, origin)
        self._free.add(beams, self._pose_error.error, self._pose_error.sd_rad)

    def _follow_odometry(self, dt: float, origin: Array) -> None:
        """Move the tracks towards the odometry, whose errors have the mean 0.

        Nothing but that tells whether all obstacles turn around the robot. The gains are those
        of a least-squares line through the errors of the last scans.
        """
        self._scans += 1
        if dt <= 0.0:
            return
        bank, error = self._bank, self._pose_error
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
            velocity = np.where(moving[:, None], bank.state[:, 2:4], 0.0)
            ahead = np.where(moving, ahead_s - bank.time_s, 0.0)
            shift_x, shift_y = self._pose_error.shift(
                bank.state[:, 0], bank.state[:, 1], np.array(self._pose.position)
            )
            x = bank.state[:, 0] + shift_x + bank.shift_m[:, 0] + velocity[:, 0] * ahead
            y = bank.state[:, 1] + shift_y + bank.shift_m[:, 1] + velocity[:, 1] * ahead
            speed_sd = bank.speed_sd_mps
            enlargement = (
                p.allowance_m
                + p.position_sd_factor * bank.position_sd_m
                + p.speed_sd_factor_s * np.minimum(speed_sd, _MOST_SPEED_SD)
                + np.maximum(bank.rms_m - math.sqrt(self._range_variance), 0.0)
            )
            r = bank.state[:, RADIUS] + np.minimum(enlargement, _MAX_ENLARGEMENT_M)
            circles = [
                Circle(
                    center_m=(cx, cy),
                    radius_m=cr + robot_radius_m,
                    velocity_mps=(vx, vy),
                    velocity_sd_mps=sd,
                )
                for cx, cy, cr, (vx, vy), sd in zip(
                    x.tolist(), y.tolist(), r.tolist(), velocity.tolist(), speed_sd.tolist()
                )
            ]
        radius = robot_radius_m + p.allowance_m
        circles += [Circle(center_m=point, radius_m=radius) for point in self._walls]
        return tuple(circles)

    def _expected_times(self, beams: Beams, origin: Array) -> Array:
        """When the beams meet each track, s after the stamp; (m,)."""
        bank = self._bank
        if not (bank.count and beams.time_s.size and beams.time_s.any()):
            return np.zeros(bank.count)
        bearing = np.arctan2(bank.state[:, 1] - origin[1], bank.state[:, 0] - origin[0])
        index = np.clip(beams.index_of(bearing), 0, beams.count - 1)
        time_s = np.zeros(beams.count)
        time_s[beams.number] = beams.time_s
        times: Array = time_s[index]
        return times

    def _pose_sd(self, origin: Array, state: Array) -> Array:
        """Standard deviation of the tracks' measured places by errors of the odometry; (m,)."""
        dx, dy = state[:, 0] - origin[0], state[:, 1] - origin[1]
        e = self._pose_error
        sd: Array = np.sqrt(e.variance_m2 + e.variance_rad2 * (dx * dx + dy * dy))
        return sd

    def _segments(self, beams: Beams, sd: Array) -> tuple[Segments, Array]:
        """The scan's segments and the distances (k, m) of its returns from the tracks."""
        taken = taken_from_a_gap(beams)
        r = beams.range_m[taken]
        x = beams.origin_x[taken] + r * beams.cos[taken]
        y = beams.origin_y[taken] + r * beams.sin[taken]
        label, off = expected_labels(x, y, self._bank.state, np.minimum(sd, 0.2))
        noise = math.sqrt(self._range_variance)
        join, hump = self.params.join_m + 3.0 * noise, self.params.hump_m + 2.5 * noise
        bank = self._bank
        radius_sd = np.sqrt(bank.covariance[:, RADIUS, RADIUS])
        round_ = (bank.scans >= _ROUND_SCANS) & (radius_sd < _ROUND_SD_M)
        return segments(beams, taken, x, y, label, round_, join, hump), off

    def _use(self, beams: Beams, found: Segments, track: Array, origin: Array) -> None:
        """Fit the groups, and update, start and drop tracks by them."""
        bank, p = self._bank, self.params
        known = np.unique(track[track != NONE])
        new = np.flatnonzero(track == NONE)
        group_of_track = np.full(bank.count, NONE)
        group_of_track[known] = np.arange(known.size)
        group = np.where(track == NONE, 0, group_of_track[track]) if bank.count else track.copy()
        group[new] = known.size + np.arange(new.size)
        groups = known.size + new.size
        self._walls = []
        updated = np.zeros(bank.count, dtype=bool)
        if groups:
            radius = np.full(groups, p.radius_m)
            variance = np.full(groups, p.radius_sd_m**2)
            radius[: known.size] = bank.state[known, RADIUS]
            variance[: known.size] = bank.covariance[known, RADIUS, RADIUS] + 0.03**2
            outline = _outline(beams, found, group, groups, radius)
            fitted = fit(outline.returns, outline.start, radius, variance, self._variance())
            wall = self._is_wall(fitted, outline)
            is_known = np.arange(groups) < known.size
            round_known = (~wall & is_known).nonzero()[0]
            self._correct(known[round_known], round_known, fitted, origin)
            updated[known[round_known]] = True
            self._learn_noise(fitted, outline, ~wall)
            self._judge(known[round_known], round_known, fitted, outline)
            self._start(np.flatnonzero(~wall & ~is_known), fitted, outline, origin)
            self._walls = _thinned(found, wall[group[found.segment]])
        self._drop(beams, origin, updated)

    def _variance(self) -> float:
        return self._range_variance

    def _is_wall(self, fitted: Fit, outline: _Outline) -> Array:
        """Groups that are no circles: too wide, or far from round; (g,)."""
        limit = 0.06 + 3.0 * math.sqrt(self._range_variance)
        wall: Array = (
            (fitted.z[:, 2] > self.params.widest_m)
            | (outline.width_m > 2.0 * self.params.widest_m)
            | (fitted.rms_m > limit)
        )
        return wall

    def _correct(self, index: Array, group: Array, fitted: Fit, origin: Array) -> None:
        """Update tracks by their groups, less the error of the odometry."""
        bank, error = self._bank, self._pose_error
        measured = fitted.z[group, :2]
        predicted, covariance = bank.expected(index)
        covariance += fitted.covariance[group][:, :2, :2]
        settled = bank.scans[index] >= _KNOWN
        left = error.estimate(measured, predicted, covariance, settled, origin)
        if not index.size:
            return
        sx, sy = error.shift(measured[:, 0], measured[:, 1], origin)
        information = fitted.information[group]
        vector = fitted.vector[group]
        vector -= information[:, :, 0] * sx[:, None] + information[:, :, 1] * sy[:, None]
        noise = error.noise(measured, left, origin)
        bank.update(index, information, vector, noise, self.params.speed_sd_mps)
        bank.known_s[index] += bank.unseen_s[index]
        bank.unseen_s[index] = bank.predicted_s[index] = 0.0
        bank.scans[index] += 1
        bank.rms_m[index] = fitted.rms_m[group]
        bank.missed[index] = 0

    def _learn_noise(self, fitted: Fit, outline: _Outline, round_: Array) -> None:
        """Learn the range's variance from the residuals of groups of many returns."""
        count = outline.returns.count
        many = round_ & (count >= 6.0) & outline.whole
        if many.any():
            sample = float(
                np.sort(fitted.rms_m[many] ** 2 * count[many] / (count[many] - 3.0))[
                    int(many.sum()) // 2
                ]
            )
            low, high = self.params.range_sd_m**2, 0.05**2
            learnt = self._range_variance + 0.1 * (sample - self._range_variance)
            self._range_variance = min(max(learnt, low), high)

    def _judge(self, index: Array, group: Array, fitted: Fit, outline: _Outline) -> None:
        """Decide which tracks move."""
        bank = self._bank
        if not index.size:
            return
        v = bank.state[index, 2:4]
        speed2 = v[:, 0] ** 2 + v[:, 1] ** 2
        P = bank.covariance[index]
        significance = speed2 / (0.5 * (P[:, VX, VX] + P[:, VY, VY]))
        moving = bank.moving[index]
        fast = speed2 > _LEAST_SPEED**2
        begins = ~moving & (significance > _MOVES) & fast
        noise = math.sqrt(self._range_variance)
        clean = outline.whole[group] & (fitted.rms_m[group] < 0.02 + 2.0 * noise)
        self._clean = dict(zip(index.tolist(), zip(outline.whole[group].tolist(),significance.tolist())))
        unclear = np.flatnonzero(begins & ~clean)
        if unclear.size:
            self._look_for_free_space(index[unclear], group[unclear], outline)
        believed = clean | (bank.appeared_s[index] < _APPEARED_S)
        moving = np.where(moving, (significance > _RESTS) & fast, begins & believed)
        bank.moving[index] = moving

    def _look_for_free_space(self, index: Array, group: Array, outline: _Outline) -> None:
        returns, error = outline.returns, self._pose_error
        position = np.full(outline.start.shape[0], NONE)
        position[group] = np.arange(group.size)
        of = position[returns.group]
        chosen = of != NONE
        x, y = returns.x[chosen], returns.y[chosen]
        sx, sy = error.shift(x, y, np.array(self._pose.position))
        margin = 3.0 * math.sqrt(self._range_variance) + 2.0 * error.sd_m
        appeared = self._free.appeared(x - sx, y - sy, margin)
        share = np.bincount(of[chosen], appeared, group.size)
        total = np.bincount(of[chosen], minlength=group.size)
        self._bank.appeared_s[index[share >= np.maximum(0.3 * total, 1.0)]] = 0.0

    def _start(self, group: Array, fitted: Fit, outline: _Outline, origin: Array) -> None:
        """Start a track for each of these groups."""
        group = group[~self._fragment(group, fitted, outline)]
        if not group.size:
            return
        z = fitted.z[group].copy()
        sx, sy = self._pose_error.shift(z[:, 0], z[:, 1], origin)
        z[:, 0] -= sx
        z[:, 1] -= sy
        self._bank.add(
            z, fitted.covariance[group], outline.time_s[group], fitted.rms_m[group],
            self.params.speed_sd_mps,
        )  # fmt: skip

    def _fragment(self, group: Array, fitted: Fit, outline: _Outline) -> Array:
        """Which of these groups are one or two returns at the edge of a larger group's circle."""
        returns = outline.returns
        small = returns.count[group] <= 2.0
        large = np.flatnonzero(returns.count > 2.0)
        if not (small.any() and large.size):
            return np.zeros(group.size, dtype=bool)
        z = fitted.z[large]
        dx, dy = returns.x[:, None] - z[:, 0], returns.y[:, None] - z[:, 1]
        limit = z[:, RADIUS_OF_FIT] + _FRAGMENT_M + 2.0 * math.sqrt(self._range_variance)
        inside = (dx * dx + dy * dy < limit * limit).any(axis=1)
        outside = np.bincount(returns.group, ~inside, returns.count.size)
        fragment: Array = small & (outside[group] == 0.0)
        return fragment

    def _drop(self, beams: Beams, origin: Array, updated: Array) -> None:
        """Drop tracks that beams see through, that are inside others, or unseen for too long."""
        bank, p = self._bank, self.params
        unseen = np.zeros(bank.count, dtype=bool)
        unseen[: updated.size] = ~updated
        index = np.flatnonzero(unseen)
        if not index.size:
            return
        state = bank.state[index]
        dx, dy = state[:, 0] - origin[0], state[:, 1] - origin[1]
        d = np.sqrt(dx * dx + dy * dy)
        number = beams.index_of(np.arctan2(dy, dx))
        inside = (number >= 0) & (number < beams.count)
        reach = np.zeros(beams.count)
        reach[beams.number] = np.minimum(beams.range_m, beams.longest_m)
        margin = _SEES_PAST_M + 2.0 * np.minimum(bank.position_sd_m[index], 0.15)
        through = inside & (2.0 * state[:, RADIUS] > d * beams.spacing_rad)
        for beside in (-1, 0, 1):
            near = reach[(np.where(inside, number, 0) + beside) % beams.count]
            through &= near > d + margin
        bank.missed[index] += through
        seen = np.flatnonzero(~unseen)
        covered = np.zeros(index.size, dtype=bool)
        if seen.size:
            other = bank.state[seen]
            ox, oy = state[:, 0, None] - other[:, 0], state[:, 1, None] - other[:, 1]
            covered = (ox * ox + oy * oy < other[:, RADIUS] ** 2).any(axis=1)
        longest = np.where(bank.moving[index], p.forget_s, p.forget_standing_s)
        longest = np.minimum(longest, _NEW_S + 2.0 * bank.known_s[index])
        P = bank.covariance[index]
        lost = bank.moving[index] & (P[:, 0, 0] + P[:, 1, 1] > _LOST_VARIANCE)
        few = bank.scans[index] < 3
        gone = (bank.missed[index] >= np.where(few, 1, _MOST_MISSED)) | covered | lost
        gone |= bank.unseen_s[index] > longest
        kept = np.ones(bank.count, dtype=bool)
        kept[index[gone]] = False
        bank.keep(kept)


@dataclass(frozen=True, slots=True)
class _Outline:
    """What the fit needs of each group of segments."""

    returns: Returns
    start: Array  # (g, 3)
    width_m: Array  # (g,) between the outermost returns
    whole: Array  # (g,) both edges are sure
    time_s: Array  # (g,) after the stamp


def _outline(
    beams: Beams, found: Segments, group: Array, groups: int, radius_m: Array
) -> _Outline:
    """Returns and edges by group; the edges are those of a group's outermost segments."""
    order = np.arange(found.count)
    lowest, highest = np.full(groups, found.count), np.full(groups, -1)
    np.minimum.at(lowest, group, order)
    np.maximum.at(highest, group, order)
    first, last = found.first[lowest], found.last[highest]
    right_gap, left_gap = found.right_gap_rad[lowest], found.left_gap_rad[highest]
    of_return = group[found.segment]
    count = np.bincount(of_return, minlength=groups).astype(np.float64)
    b_first, b_last = found.beam[first], found.beam[last]
    right = _turned(beams.cos[b_first], beams.sin[b_first], -0.5 * right_gap)
    left = _turned(beams.cos[b_last], beams.sin[b_last], 0.5 * left_gap)
    sure_right, sure_left = right_gap > 0.0, left_gap > 0.0
    edge_group = np.concatenate((np.flatnonzero(sure_right), np.flatnonzero(sure_left)))
    returns = Returns(
        x=found.x,
        y=found.y,
        group=of_return,
        edge_x=np.concatenate(
            (beams.origin_x[b_first][sure_right], beams.origin_x[b_last][sure_left])
        ),
        edge_y=np.concatenate(
            (beams.origin_y[b_first][sure_right], beams.origin_y[b_last][sure_left])
        ),
        normal_x=np.concatenate((right[sure_right, 1], -left[sure_left, 1])),
        normal_y=np.concatenate((-right[sure_right, 0], left[sure_left, 0])),
        edge_gap_m=np.concatenate(
            (
                (right_gap * found.range_m[first])[sure_right],
                (left_gap * found.range_m[last])[sure_left],
            )
        ),
        edge_group=edge_group,
        count=count,
    )
    nearest = np.full(groups, np.inf)
    np.minimum.at(nearest, of_return, found.range_m)
    origin = 0.5 * np.column_stack(
        (
            beams.origin_x[b_first] + beams.origin_x[b_last],
            beams.origin_y[b_first] + beams.origin_y[b_last],
        )
    )
    whole = sure_right & sure_left
    dx, dy = found.x[last] - found.x[first], found.y[last] - found.y[first]
    return _Outline(
        returns=returns,
        start=start_of(origin, nearest, right, left, whole, radius_m),
        width_m=np.sqrt(dx * dx + dy * dy),
        whole=whole,
        time_s=0.5 * (beams.time_s[b_first] + beams.time_s[b_last]),
    )


def _turned(cos: Array, sin: Array, angle: Array) -> Array:
    """Directions (g, 2) turned by small angles, to third order and exactly of unit length."""
    t = 0.5 * angle
    c, s = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
    return np.column_stack((cos * c - sin * s, sin * c + cos * s))


def _thinned(found: Segments, wall: Array) -> list[Point]:
    """Returns (k,) of walls, about _POINT_SPACING_M apart along each segment."""
    index = np.flatnonzero(wall)
    if not index.size:
        return []
    x, y, of = found.x[index], found.y[index], found.segment[index]
    step = np.zeros(index.size)
    step[1:] = np.sqrt((x[1:] - x[:-1]) ** 2 + (y[1:] - y[:-1]) ** 2)
    along = np.floor(np.cumsum(step) / _POINT_SPACING_M)
    kept = np.ones(index.size, dtype=bool)
    kept[1:] = (along[1:] != along[:-1]) | (of[1:] != of[:-1])
    kept[:-1] |= of[1:] != of[:-1]  # and the last of each
    return list(zip(x[kept].tolist(), y[kept].tolist()))
