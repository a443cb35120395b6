# SPDX-License-Identifier: Apache-2.0
"""Outlines of groups of segments: what a circle fit needs, and points of what is no circle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point
from .circle_fit import Returns, start_of
from .scan_beams import Beams
from .scan_segments import Segments

Array = np.ndarray

_POINT_SPACING_M = 0.08  # between points of a wall


@dataclass(frozen=True, slots=True)
class Outline:
    """What the fit needs of each group of segments."""

    returns: Returns
    start: Array  # (3, g)
    width_m: Array  # (g,) between the outermost returns
    whole: Array  # (g,) both edges are sure
    half: Array  # (g,) at least one is
    alone: Array  # (g,) nothing is near behind both
    time_s: Array  # (g,) after the stamp


def outline_of(
    beams: Beams, found: Segments, group: Array, groups: int, radius_m: Array
) -> Outline:
    """Returns and edges by group; the edges are those of a group's outermost segments."""
    # Of a group's segments the one assigned last remains.
    order = np.arange(found.count)
    lowest, highest = np.empty(groups, dtype=np.int64), np.empty(groups, dtype=np.int64)
    lowest[group[::-1]] = order[::-1]
    highest[group] = order
    ends = np.concatenate((found.first[lowest], found.last[highest]))
    gap = np.concatenate((found.right_gap_rad[lowest], found.left_gap_rad[highest]))
    beam = found.beam.take(ends)
    places = np.array((beams.origin_x.take(beam), beams.origin_y.take(beam)))
    # The tangent lies in the middle of the gap; turned exactly, by half the tangent of the half.
    t = 0.25 * gap
    t[:groups] *= -1.0
    scale = 1.0 / (1.0 + t * t)
    turn_cos, turn_sin = (1.0 - t * t) * scale, 2.0 * t * scale
    cos, sin = beams.cos.take(beam), beams.sin.take(beam)
    directions = np.array((cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin))
    right, left = directions[:, :groups], directions[:, groups:]
    normals = np.concatenate((right[::-1], left[::-1]), axis=1)
    normals[1, :groups] *= -1.0
    normals[0, groups:] *= -1.0
    sure = gap > 0.0
    edges = sure.nonzero()[0]
    of_return = group.take(found.segment)
    returns = Returns(
        xy=found.xy,
        group=of_return,
        edge_xy=places.take(edges, axis=1),
        normal=normals.take(edges, axis=1),
        edge_gap_m=(gap * found.range_m.take(ends)).take(edges),
        edge_group=edges % groups,
        count=np.bincount(of_return, minlength=groups).astype(np.float64),
    )
    nearest = np.full(groups, np.inf)
    np.minimum.at(nearest, group, np.minimum.reduceat(found.range_m, found.first))
    origin = 0.5 * (places[:, :groups] + places[:, groups:])
    whole = sure[:groups] & sure[groups:]
    outermost, time_s = found.xy.take(ends, axis=1), beams.time_s.take(beam)
    dx, dy = outermost[:, groups:] - outermost[:, :groups]
    return Outline(
        returns=returns,
        start=start_of(origin, nearest, right, left, whole, radius_m),
        width_m=np.sqrt(dx * dx + dy * dy),
        whole=whole,
        alone=found.alone.take(lowest) & found.alone.take(highest),
        half=sure[:groups] | sure[groups:],
        time_s=0.5 * (time_s[:groups] + time_s[groups:]),
    )


def thinned(found: Segments, wall: Array) -> list[Point]:
    """Returns (k,) of walls, about _POINT_SPACING_M apart along each segment."""
    index = np.flatnonzero(wall)
    if not index.size:
        return []
    (x, y), of = found.xy[:, index], found.segment[index]
    step = np.zeros(index.size)
    step[1:] = np.sqrt((x[1:] - x[:-1]) ** 2 + (y[1:] - y[:-1]) ** 2)
    along = np.floor(np.cumsum(step) / _POINT_SPACING_M)
    kept = np.ones(index.size, dtype=bool)
    kept[1:] = (along[1:] != along[:-1]) | (of[1:] != of[:-1])
    kept[:-1] |= of[1:] != of[:-1]  # and the last of each
    return list(zip(x[kept].tolist(), y[kept].tolist()))
