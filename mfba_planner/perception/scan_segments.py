# SPDX-License-Identifier: Apache-2.0
"""Segments of a scan: neighbouring returns of one surface, and the edges that show its width."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .scan_beams import Beams

Array = np.ndarray

_JOIN_SPACINGS = 3.0  # neighbours of one surface are nearer than so many spacings of the beams
_JOIN_MOST_M = 0.6
_EDGE_STEP_M = 0.1  # the beam beside an edge ends at least so much farther
_ALONE_M = 0.4
_LIMIT_M = 0.2  # surfaces so near to the longest range may continue beyond it
_MOST_MISSING = 3  # beam numbers between neighbours of one segment
_PASSES = 4  # cuts at humps within one segment, each halving it
_APART = 1e4  # m, offset between segments whose running minima must not meet


@dataclass(frozen=True, slots=True)
class Segments:
    """n segments of k returns, in the order of their angles.

    left and right refer to the robot: the first return of a segment is at its right edge. An
    edge is sure if the beam beside it went on for at least 0.1 m: there the surface ends.
    """

    xy: Array  # (2, k) m, returns in odom
    beam: Array  # (k,) index in Beams
    range_m: Array  # (k,) m
    segment: Array  # (k,) int, ascending
    first: Array  # (n,) index of a segment's first return
    last: Array
    right_gap_rad: Array  # (n,) angle to the beam beside the edge; 0 if the edge is not sure
    left_gap_rad: Array
    alone: Array  # (n,) the beams on both sides went on for at least 0.4 m

    @property
    def count(self) -> int:
        """Number of segments."""
        return self.first.size


def no_segments() -> Segments:
    """Of a scan without returns."""
    none, empty = np.empty(0, dtype=np.int64), np.empty(0)
    return Segments(np.empty((2, 0)), none, empty, none, none, none, empty, empty, none > 0)


def segments(
    beams: Beams,
    taken: Array,
    xy: Array,
    label: Array,
    known: Array,
    join_m: float,
    hump_m: float,
) -> Segments:
    """Cut the returns of a scan.

    taken (k,) are the indices of beams with a return, from taken_from_a_gap(), and xy (2, k)
    where they are. label (k,) is the number of the obstacle at which a return is expected, or
    -1: where it changes from one obstacle to another there is a cut, and where it changes to
    none from one whose outline is known (m,): something else begins there.
    """
    if not taken.size:
        return no_segments()
    r = beams.range_m.take(taken)
    squares = xy[:, 1:] - xy[:, :-1]
    squares *= squares
    limit = np.minimum(r[1:], r[:-1])
    limit *= _JOIN_SPACINGS * beams.spacing_rad
    np.minimum(limit, _JOIN_MOST_M, out=limit)
    np.maximum(limit, join_m, out=limit)
    limit *= limit
    cut = squares[0] + squares[1] > limit
    size = beams.range_m.size
    step = taken[1:] - taken[:-1]
    cut |= (step != 1) & (step != 1 - size)  # with something between that met nothing
    if size < beams.count:
        number = beams.number.take(taken)
        cut |= (number[1:] - number[:-1]) % beams.count > _MOST_MISSING
    if known.size:
        one, other = label[1:], label[:-1]
        surely = known[np.maximum(one, other)]  # of the obstacle, if the other is none
        cut |= (one != other) & ((np.minimum(one, other) >= 0) | surely)
    _cut_at_humps(r, cut, hump_m)
    ends = cut.nonzero()[0]
    first, last = np.zeros((2, ends.size + 1), dtype=np.int64)
    last[:-1], last[-1] = ends, r.size - 1
    np.add(ends, 1, out=first[1:])
    segment = np.zeros(r.size, dtype=np.int64)
    np.add.accumulate(cut, dtype=np.int64, out=segment[1:])
    right, left, alone = _edges(beams, taken, first, last)
    return Segments(xy, taken, r, segment, first, last, right, left, alone)


def _cut_at_humps(r: Array, cut: Array, hump_m: float) -> None:
    """Cut where ranges rise and fall again by hump_m: two convex bodies side by side.

    The height of a return is that above the lower of the two nearest returns on its sides; the
    highest of a segment is cut, then its parts are looked at again. Changes cut (k - 1,).
    """
    if r.size < 3:
        return
    joined = ~cut
    smooth = r.copy()  # the mean of three, where all are of one segment
    mean = r[:-2] + r[1:-1]
    mean += r[2:]
    mean /= 3.0
    np.copyto(smooth[1:-1], mean, where=joined[1:] & joined[:-1])
    offset = np.zeros(r.size)
    for _ in range(_PASSES):
        np.add.accumulate(cut, dtype=np.float64, out=offset[1:])
        offset *= _APART
        before = np.minimum.accumulate(smooth - offset)
        before += offset
        after = np.minimum.accumulate((smooth + offset)[::-1])[::-1]
        after -= offset
        height = smooth - np.maximum(before, after)
        high = (height > hump_m).nonzero()[0]
        if not high.size:
            return
        # The highest of each segment: sorted by segment, then by height, the last one.
        number = offset[high]
        order = np.lexsort((height[high], number))
        number = number[order]
        top = high[order[np.concatenate((number[1:] != number[:-1], [True]))]]
        # The return itself stays with the nearer of its neighbours.
        top = top[(top > 0) & (top < r.size - 1)]
        if not top.size:
            return
        with_next = np.abs(r[top + 1] - r[top]) < np.abs(r[top] - r[top - 1])
        cut[np.where(with_next, top - 1, top)] = True


def _edges(beams: Beams, taken: Array, first: Array, last: Array) -> tuple[Array, Array, Array]:
    """Angles from the outermost returns to the beams beside them; 0 where that is no edge.

    And whether both of these beams went on far behind.
    """
    size, n = beams.range_m.size, first.size
    index = taken.take(np.concatenate((first, last)))
    beside = index + 1
    beside[:n] -= 2
    r = beams.range_m.take(index)
    wrapped = beside % size
    behind = beams.range_m.take(wrapped)
    behind -= r
    gap = beams.number.take(wrapped)
    gap -= beams.number.take(index)
    gap[:n] *= -1
    gap %= beams.count
    angle = gap * beams.spacing_rad
    sure = (behind > _EDGE_STEP_M) & (r < beams.longest_m - _LIMIT_M)
    sure &= angle < 0.5 * math.pi
    if not beams.turns:
        sure &= beside == wrapped
    angle *= sure
    sure &= behind > _ALONE_M
    return angle[:n], angle[n:], sure[:n] & sure[n:]


def taken_from_a_gap(beams: Beams) -> Array:
    """Indices (k,) of the beams with a return, in the order of their angles.

    In a full turn the first is one after a beam that met nothing or, without such, after the
    largest step: no surface may begin at the end of the arrays and go on at their start.
    """
    hit = np.isfinite(beams.range_m)
    taken = hit.nonzero()[0]
    if not beams.turns or taken.size < 2:
        return taken
    if taken.size < hit.size:
        start = int(hit.argmin())  # all before it have a return, so it is a place in taken too
    else:
        r = beams.range_m
        start = int(np.abs(r[1:] - r[:-1]).argmax()) + 1
    return np.concatenate((taken[start:], taken[:start])) if 0 < start < taken.size else taken
