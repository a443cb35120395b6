# SPDX-License-Identifier: Apache-2.0
"""Which segment belongs to which track: nearest pairs first."""

from __future__ import annotations

import numpy as np

from .scan_segments import Segments

Array = np.ndarray

NONE = -1
_GATE_PER_RADIUS = 0.3  # where an obstacle is partly hidden, its middle shifts by part of its size
_ALONG_WEIGHT = 0.3  # of the distance between the middles, beside that from the surface
_ON_CIRCLE_M = 0.1  # returns so near to a circle's surface are its own


def expected_labels(x: Array, y: Array, state: Array, tolerance_m: Array) -> tuple[Array, Array]:
    """Track (k,) on whose predicted surface each point (k,) lies, or -1; and distances (k, m)."""
    if not state.shape[0] or not x.size:
        return np.full(x.size, NONE), np.empty((x.size, state.shape[0]))
    dx, dy = x[:, None] - state[:, 0], y[:, None] - state[:, 1]
    off = np.abs(np.sqrt(dx * dx + dy * dy) - state[:, 4])
    label = off.argmin(axis=1)
    least = off[np.arange(x.size), label]
    return np.where(least <= tolerance_m[label], label, NONE), off


def associate(
    found: Segments, off: Array, origin: Array, state: Array, sd_m: Array, gate_m: Array
) -> Array:
    """Track of each segment (n,), or -1. Each track gets at most one segment at first.

    off (k, m) are the distances of returns from the predicted surfaces. The cost of a pair is
    the distance of the segment's middle return from the surface, plus a share of its distance
    from the middle of the visible side. Then segments wholly on a track's circle, as when
    something thin stands before it, go to that track as well.
    """
    n, m = found.count, state.shape[0]
    track = np.full(n, NONE)
    if not (n and m):
        return track
    middle = (found.first + found.last) // 2
    dx, dy = state[:, 0] - origin[0], state[:, 1] - origin[1]
    d = np.sqrt(dx * dx + dy * dy) + 1e-9
    share = np.maximum(d - state[:, 4], 0.0) / d
    fx = found.x[middle][:, None] - (origin[0] + dx * share)
    fy = found.y[middle][:, None] - (origin[1] + dy * share)
    cost = off[middle] + _ALONG_WEIGHT * np.sqrt(fx * fx + fy * fy)
    gate = gate_m + _GATE_PER_RADIUS * np.minimum(state[:, 4], 1.0) + 2.0 * sd_m
    cost[cost > gate] = np.inf
    for _ in range(min(n, m)):
        of_segment = cost.argmin(axis=1)  # nearest track of each segment
        least = cost[np.arange(n), of_segment]
        of_track = cost.argmin(axis=0)
        mutual = np.flatnonzero((of_track[of_segment] == np.arange(n)) & np.isfinite(least))
        if not mutual.size:
            break
        track[mutual] = of_segment[mutual]
        cost[mutual] = np.inf
        cost[:, of_segment[mutual]] = np.inf
    rest = np.flatnonzero(track == NONE)
    if rest.size:
        worst = np.maximum.reduceat(off, found.first, axis=0)[rest]
        nearest = worst.argmin(axis=1)
        on = worst[np.arange(rest.size), nearest] <= _ON_CIRCLE_M + np.minimum(sd_m[nearest], 0.2)
        track[rest[on]] = nearest[on]
    return track
