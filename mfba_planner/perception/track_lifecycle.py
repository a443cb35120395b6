# SPDX-License-Identifier: Apache-2.0
"""What happens to tracks beside their filter: whether they move, and when they end."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..core.geometry import Point
from .circle_fit import Fit
from .group_outline import Outline
from .scan_beams import Beams
from .track_bank import RADIUS, VX, VY, TrackBank
from .tracking_params import TrackingParams

Array = np.ndarray
Appeared = Callable[[Array, Array], Array]

_MOVES, _RESTS = 12.0, 4.0  # squared significances of a velocity: begins to move, is at rest
_SURELY_MOVES = 100.0  # where one edge only is known
_STREAK = 4  # scans in a row with a significant velocity, without returns in free space
_STREAK_ALONE = 2  # where nothing is near
_MOST_SPEED = 4.0  # m/s; what seems faster is another surface
_UNKNOWN_SPEED_SD = 0.15  # m/s
_LEAST_SPEED = 0.03  # m/s; slower counts as at rest
_APPEARED_S = 1.0  # for so long after returns in free space a velocity is believed
_SEES_PAST_M = 0.15  # beams that end so much behind a circle have seen through it
_MIDDLE_SHARE = 0.7  # of a radius: beams so near to the centre must meet the circle
_MOST_MISSED = 2  # scans in a row that see through a track before it is dropped
_NEW_S = 0.25  # a track is kept so long without a return, and as long again as it was seen
_LOST_VARIANCE = 0.25  # m^2, of a centre too uncertain to keep
_FRAGMENT_M = 0.05


def judge_motion(
    bank: TrackBank,
    index: Array,
    group: Array,
    fitted: Fit,
    outline: Outline,
    noise_m: float,
    appeared: Appeared,
) -> None:
    """Decide which of the tracks of these indices move.

    appeared tells of points (k,) whether they lie in space that was seen free.
    """
    if not index.size:
        return
    squares = bank.state[VX:].take(index, axis=1) ** 2
    speed2 = squares[0] + squares[1]
    P = bank.covariance
    variance = 0.5 * (P[VX, VX] + P[VY, VY])[index]
    significance = speed2 / variance
    moving = bank.moving[index]
    fast = speed2 > _LEAST_SPEED**2
    fast &= speed2 < _MOST_SPEED**2
    begins = ~moving & (significance > _MOVES) & fast
    round_ = fitted.rms_m[group] < 0.02 + 2.0 * noise_m
    surely = (significance > _SURELY_MOVES) & outline.half[group]
    clean = round_ & (outline.whole[group] | surely)
    candidate = begins.nonzero()[0]
    if candidate.size:
        _look_for_free_space(bank, index[candidate], group[candidate], outline, appeared)
    streak = bank.streak[index] = np.where(begins, bank.streak[index] + 1, 0)
    lasts = clean & (streak >= np.where(outline.alone[group], _STREAK_ALONE, _STREAK))
    believed = lasts | (bank.appeared_s[index] < _APPEARED_S)
    # What has just turned moves on, though its velocity is not known well.
    still = (significance > _RESTS) | (variance > _UNKNOWN_SPEED_SD**2)
    moving = np.where(moving, still & fast, begins & believed)
    bank.moving[index] = moving


def _look_for_free_space(
    bank: TrackBank, index: Array, group: Array, outline: Outline, appeared: Appeared
) -> None:
    returns = outline.returns
    chosen = np.zeros(returns.count.size, dtype=bool)
    chosen[group] = True
    index_of_return = chosen.take(returns.group).nonzero()[0]
    x, y = returns.xy.take(index_of_return, axis=1)
    found = np.bincount(returns.group.take(index_of_return), appeared(x, y), returns.count.size)[
        group
    ]
    bank.appeared_s[index[found >= np.maximum(0.3 * returns.count[group], 1.0)]] = 0.0


def fragments(group: Array, fitted: Fit, outline: Outline, wall: Array, noise_m: float) -> Array:
    """Which of these groups are one or two returns at the edge of a larger group's circle."""
    returns = outline.returns
    small = returns.count[group] <= 2.0
    large = (~wall & (returns.count > 2.0)).nonzero()[0]
    if not (small.any() and large.size):
        return np.zeros(group.size, dtype=bool)
    x, y, r = fitted.z[:, large]
    dx, dy = returns.xy[0, :, None] - x, returns.xy[1, :, None] - y
    limit = r + _FRAGMENT_M + 2.0 * noise_m
    inside = (dx * dx + dy * dy < limit * limit).any(axis=1)
    outside = np.bincount(returns.group, ~inside, returns.count.size)
    fragment: Array = small & (outside[group] == 0.0)
    return fragment


def drop_lost(
    bank: TrackBank,
    beams: Beams,
    origin: Point,
    updated: Array,
    pose_sd_m: Array,
    params: TrackingParams,
) -> None:
    """Drop tracks that beams see through, that are inside others, or unseen for too long."""
    p = params
    unseen = np.zeros(bank.count, dtype=bool)
    unseen[: updated.size] = ~updated
    index = unseen.nonzero()[0]
    if not index.size:
        return
    x, y = bank.state[:2, index]
    dx, dy = x - origin[0], y - origin[1]
    bank.missed[index] += _beams_through(bank, beams, index, dx, dy, pose_sd_m[index])
    other_x, other_y, other_r = bank.state[:VX, ~unseen]
    ox, oy = x[:, None] - other_x, y[:, None] - other_y
    covered = (ox * ox + oy * oy < other_r**2).any(axis=1)
    longest = np.where(bank.moving[index], p.forget_s, p.forget_standing_s)
    longest = np.minimum(longest, _NEW_S + 2.0 * bank.known_s[index])
    P = bank.covariance
    lost = bank.moving[index] & ((P[0, 0] + P[1, 1])[index] > _LOST_VARIANCE)
    few = bank.scans[index] < 3
    gone = (bank.missed[index] >= np.where(few, 1, _MOST_MISSED)) | covered | lost
    gone |= bank.unseen_s[index] > longest
    kept = np.ones(bank.count, dtype=bool)
    kept[index[gone]] = False
    bank.keep(kept)


def _beams_through(
    bank: TrackBank, beams: Beams, index: Array, dx: Array, dy: Array, pose_sd_m: Array
) -> Array:
    """Whether the beams through the middle of each circle end behind it, and there is one; (j,).

    dx and dy (j,) are the centres relative to the robot.
    """
    d = np.sqrt(dx * dx + dy * dy)
    bearing = np.arctan2(dy, dx)
    number = beams.index_of(bearing)
    inside = (number >= 0) & (number < beams.count)
    number = np.where(inside, number, 0)
    off = np.remainder(bearing - beams.angle_min_rad - number * beams.spacing_rad, 2.0 * math.pi)
    off = np.where(off > math.pi, off - 2.0 * math.pi, off)
    reach = np.zeros(beams.count)
    reach[beams.number] = np.minimum(beams.range_m, beams.longest_m)
    margin = _SEES_PAST_M + 2.0 * np.minimum(bank.position_sd_m[index], 0.15)
    middle = _MIDDLE_SHARE * bank.state[RADIUS, index] - pose_sd_m
    any_beam, all_pass = np.zeros(index.size, dtype=bool), inside
    for beside in (-1, 0, 1):
        met = np.abs(off - beside * beams.spacing_rad) * d < middle
        any_beam = any_beam | met
        all_pass = all_pass & (~met | (reach[(number + beside) % beams.count] > d + margin))
    through: Array = any_beam & all_pass
    return through
