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
    start: Array  # (g, 3)
    width_m: Array  # (g,) between the outermost returns
    whole: Array  # (g,) both edges are sure
    half: Array  # (g,) at least one is
    time_s: Array  # (g,) after the stamp


def outline_of(
    beams: Beams, found: Segments, group: Array, groups: int, radius_m: Array
) -> Outline:
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
    return Outline(
        returns=returns,
        start=start_of(origin, nearest, right, left, whole, radius_m),
        width_m=np.sqrt(dx * dx + dy * dy),
        whole=whole,
        half=sure_right | sure_left,
        time_s=0.5 * (beams.time_s[b_first] + beams.time_s[b_last]),
    )


def _turned(cos: Array, sin: Array, angle: Array) -> Array:
    """Directions (g, 2) turned by small angles, to third order and exactly of unit length."""
    t = 0.5 * angle
    c, s = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
    return np.column_stack((cos * c - sin * s, sin * c + cos * s))


def thinned(found: Segments, wall: Array) -> list[Point]:
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
