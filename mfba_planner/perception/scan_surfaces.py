# SPDX-License-Identifier: Apache-2.0
"""Surfaces of a scan for the local map: returns in odom, their normals and their segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .scan_beams import Beams
from .scan_segments import taken_from_a_gap

Array = np.ndarray

_JOIN_M, _JOIN_SPACINGS = 0.15, 2.5
_MOST_MISSING = 2  # beam numbers between neighbours of one segment
_CHORD_M = 0.15  # along which a normal is measured
_MOST_CHORD = 8  # returns on each side


@dataclass(frozen=True, slots=True)
class Surfaces:
    """k returns in the order of their angles, and the segments that they are part of."""

    x: Array  # (k,) m, in odom
    y: Array
    range_m: Array  # (k,) m
    nx: Array  # (k,) unit normal towards the lidar; along the beam where the return is alone
    ny: Array
    segment: Array  # (k,) int, ascending
    first: Array  # (n,) index of a segment's first return
    last: Array
    width_m: Array  # (n,) diagonal of the box around a segment, along the axes


def surfaces(beams: Beams) -> Surfaces | None:
    """The returns of a scan with their segments; None without returns."""
    taken = taken_from_a_gap(beams)
    if not taken.size:
        return None
    r, cos, sin = beams.range_m[taken], beams.cos[taken], beams.sin[taken]
    x, y = beams.origin_x[taken] + r * cos, beams.origin_y[taken] + r * sin
    number = beams.number[taken]
    dx, dy = x[1:] - x[:-1], y[1:] - y[:-1]
    limit = np.minimum(r[1:], r[:-1])
    limit *= _JOIN_SPACINGS * beams.spacing_rad
    np.maximum(limit, _JOIN_M, out=limit)
    cut = dx * dx + dy * dy > limit * limit
    cut |= (number[1:] - number[:-1]) % beams.count > _MOST_MISSING
    last = np.concatenate((cut.nonzero()[0], [r.size - 1]))
    first = np.concatenate(([0], last[:-1] + 1))
    segment = np.zeros(r.size, dtype=np.int64)
    segment[first[1:]] = 1
    segment = np.cumsum(segment)
    half = np.clip(_CHORD_M / np.maximum(r * beams.spacing_rad, 1e-6), 1.0, _MOST_CHORD)
    half = half.astype(np.int64)
    index = np.arange(r.size)
    low = np.maximum(index - half, first[segment])
    high = np.minimum(index + half, last[segment])
    tx, ty = x[high] - x[low], y[high] - y[low]
    length = np.sqrt(tx * tx + ty * ty)
    alone = length < 1e-6
    length[alone] = 1.0
    nx = np.where(alone, -cos, -ty / length)
    ny = np.where(alone, -sin, tx / length)
    away = nx * cos + ny * sin > 0.0
    nx[away] *= -1.0
    ny[away] *= -1.0
    wx = np.maximum.reduceat(x, first) - np.minimum.reduceat(x, first)
    wy = np.maximum.reduceat(y, first) - np.minimum.reduceat(y, first)
    width = np.sqrt(wx * wx + wy * wy)
    return Surfaces(x, y, r, nx, ny, segment, first, last, width)
