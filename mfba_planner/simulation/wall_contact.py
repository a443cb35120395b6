# SPDX-License-Identifier: Apache-2.0
"""Contact between robot and wall segments, continuous in time, for many steps at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.segments import Array, Segments

_FEW = 200  # segments: up to so many are faster without a selection for each step
_STEPS = 16  # taken together: near each other, so that most segments are far from all of them


@dataclass(frozen=True, slots=True)
class WallClearances:
    """K robot steps among wall segments, all of them taken as one.

    gap_m (K,): smallest distance between the robot's edge and any segment during a step; minus
    the robot's radius where its centre crosses one. contact_s (K,): time from the start of the
    step to contact with any, if the robot keeps its velocity; 0 in contact, inf for never.
    """

    gap_m: Array
    contact_s: Array

    def select(self, which: Array) -> WallClearances:
        """Some of the steps, by a mask."""
        return WallClearances(self.gap_m[which], self.contact_s[which])


def wall_clearances(
    segments: Segments, radius_m: float, durations_s: Array, positions_m: Array
) -> WallClearances:
    """Steps of durations (K,) of a disc at positions (2, K + 1), uniform between them.

    A position that is not finite was refused and has no gap, as with obstacles.
    """
    count = len(durations_s)
    gap_m, contact_s = np.full(count, np.inf), np.full(count, np.inf)
    for first in range(0, count, _STEPS):
        steps = slice(first, min(first + _STEPS, count))
        x, y = positions_m[:, first : steps.stop + 1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ux, uy = np.diff(x), np.diff(y)
            gap_m[steps] = _nearest(segments, x, y, ux, uy) - radius_m
            shares = _first_contacts(segments, radius_m, x[:-1], y[:-1], ux, uy)
            contact_s[steps] = np.where(np.isnan(ux + uy), np.inf, shares * durations_s[steps])
    return WallClearances(gap_m, contact_s)


def _nearest(segments: Segments, x: Array, y: Array, ux: Array, uy: Array) -> Array:
    """Smallest distance (k,) of each step to any segment; points (k + 1,), steps (k,)."""
    mx, my = np.mean(x), np.mean(y)
    if not np.isfinite(mx + my):  # some point was refused
        distances = segments.swept_distances(x[:-1, None], y[:-1, None], ux[:, None], uy[:, None])
        return np.where(np.isnan(distances), np.inf, distances).min(axis=1)
    # All points of these steps are within roam of their mean, so a segment whose distance from
    # it is more than 2 roam above the least is nearest to none of them.
    roam = np.sqrt((x - mx) ** 2 + (y - my) ** 2).max()
    from_mean = segments.distances(mx, my)
    near = segments.select(from_mean <= from_mean.min() + 2.0 * roam + 1e-6)
    found: Array = near.swept_distances(x[:-1, None], y[:-1, None], ux[:, None], uy[:, None])
    return found.min(axis=1)


def _first_contacts(
    segments: Segments, radius_m: float, x: Array, y: Array, ux: Array, uy: Array
) -> Array:
    """_until_contact() of steps (k,); of many segments, only those in the path of each."""
    if segments.x.size <= _FEW:
        return _until_contact(segments, radius_m, x[:, None], y[:, None], ux[:, None], uy[:, None])
    middle_x, middle_y = segments.x + 0.5 * segments.dx, segments.y + 0.5 * segments.dy
    half = 0.5 * np.sqrt(segments.dx * segments.dx + segments.dy * segments.dy)
    wide = (half + (radius_m + 1e-6)) ** 2
    shares = np.full(len(x), np.inf)
    for k in range(len(x)):
        # A circle round each enlarged segment: does the ray meet it, or start in it?
        px, py = middle_x - x[k], middle_y - y[k]
        along, aside = px * ux[k] + py * uy[k], px * uy[k] - py * ux[k]
        ahead = (along > 0.0) & (aside * aside <= wide * (ux[k] * ux[k] + uy[k] * uy[k]))
        near = segments.select(ahead | (px * px + py * py <= wide))
        if near.x.size:
            step = (column[k : k + 1, None] for column in (x, y, ux, uy))
            shares[k] = _until_contact(near, radius_m, *step)[0]
    return shares


def _until_contact(
    segments: Segments, radius_m: float, x: Array, y: Array, ux: Array, uy: Array
) -> Array:
    """Durations of a step until a disc that goes on from (x, y) by (ux, uy) touches; (k,).

    It touches a segment at one of its ends, a circle of the radius for the centre, or along it,
    a parallel at the radius.
    """
    px, py = segments.x - x, segments.y - y
    first = np.minimum(
        _until_circle(px, py, ux, uy, radius_m),
        _until_circle(px + segments.dx, py + segments.dy, ux, uy, radius_m),
    )
    dx, dy = segments.dx, segments.dy
    length = np.sqrt(dx * dx + dy * dy)
    aside = (px * dy - py * dx) / length  # from the segment's line to the disc, to its left
    approach = (dx * uy - dy * ux) / length
    wait = (np.abs(aside) - radius_m) / np.abs(approach)
    along = (dx * (wait * ux - px) + dy * (wait * uy - py)) / (length * length)
    meets = (aside * approach < 0.0) & (wait >= 0.0) & (along >= 0.0) & (along <= 1.0)
    first = np.minimum(first, np.where(meets, wait, np.inf))
    first = np.where(segments.distances(x, y) < radius_m, 0.0, first)
    return np.where(np.isnan(first), np.inf, first).min(axis=1)


def _until_circle(px: Array, py: Array, ux: Array, uy: Array, radius_m: float) -> Array:
    """Until the point that goes on by (ux, uy) is radius_m from the point at (px, py)."""
    square, along = ux * ux + uy * uy, px * ux + py * uy
    root = along * along - square * (px * px + py * py - radius_m * radius_m)
    share = (along - np.sqrt(np.maximum(root, 0.0))) / square
    return np.where((along > 0.0) & (root >= 0.0) & (share >= 0.0), share, np.inf)
