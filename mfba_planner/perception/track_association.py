# SPDX-License-Identifier: Apache-2.0
"""Which segment belongs to which track: nearest pairs first."""

from __future__ import annotations

import numpy as np

from ..core.geometry import Point
from .scan_segments import Segments
from .track_bank import RADIUS

Array = np.ndarray

NONE = -1
_GATE_PER_RADIUS = 0.3  # where an obstacle is partly hidden, its middle shifts by part of its size
_ALONG_WEIGHT = 0.3  # of the distance between the middles, beside that from the surface
_ON_CIRCLE_M = 0.1  # returns so near to a circle's surface are its own


def expected_labels(xy: Array, state: Array, tolerance_m: Array) -> tuple[Array, Array]:
    """Track (k,) on whose predicted surface each of k points lies, or -1; distances (k, m)."""
    (x, y), m = xy, state.shape[1]
    if not m or not x.size:
        return np.full(x.size, NONE), np.empty((x.size, m))
    off, dy = x[:, None] - state[0], y[:, None] - state[1]
    off *= off
    dy *= dy
    off += dy
    np.sqrt(off, out=off)
    off -= state[RADIUS]
    np.abs(off, out=off)
    label = off.argmin(axis=1)
    least = off.ravel().take(label + m * np.arange(x.size))
    label[least > tolerance_m.take(label)] = NONE
    return label, off


def associate(
    found: Segments, off: Array, origin: Point, state: Array, sd_m: Array, gate_m: Array
) -> Array:
    """Track of each segment (n,), or -1. Each track gets at most one segment at first.

    off (k, m) are the distances of returns from the predicted surfaces. The cost of a pair is
    the distance of the segment's middle return from the surface, plus a share of its distance
    from the middle of the visible side. Then segments wholly on a track's circle, as when
    something thin stands before it, go to that track as well.
    """
    n, m = found.count, state.shape[1]
    track = np.full(n, NONE)
    if not (n and m):
        return track
    middle = (found.first + found.last) // 2
    dx, dy = state[0] - origin[0], state[1] - origin[1]
    d = np.sqrt(dx * dx + dy * dy) + 1e-9
    share = np.maximum(d - state[RADIUS], 0.0) / d
    x, y = found.xy.take(middle, axis=1)
    fx = x[:, None] - (origin[0] + dx * share)
    fy = y[:, None] - (origin[1] + dy * share)
    cost = off.take(middle, axis=0) + _ALONG_WEIGHT * np.sqrt(fx * fx + fy * fy)
    gate = gate_m + _GATE_PER_RADIUS * np.minimum(state[RADIUS], 1.0) + 2.0 * sd_m
    near = (cost <= gate).nonzero()
    taken: set[int] = set()
    for _, segment, of in sorted(zip(cost[near].tolist(), *(pair.tolist() for pair in near))):
        if of not in taken and track[segment] == NONE:
            track[segment] = of
            taken.add(of)
    rest = (track == NONE).nonzero()[0]
    if rest.size:
        worst = np.maximum.reduceat(off, found.first, axis=0)[rest]
        nearest = worst.argmin(axis=1)
        on = worst[np.arange(rest.size), nearest] <= _ON_CIRCLE_M + np.minimum(sd_m[nearest], 0.2)
        track[rest[on]] = nearest[on]
    return track
