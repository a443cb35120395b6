# SPDX-License-Identifier: Apache-2.0
"""The gap vector Vg (eq. 12, 13, Table 1) and the choice of the gap nearest to the goal."""

from __future__ import annotations

import math
from enum import Enum
from functools import cache, lru_cache

from ..core.geometry import wrap_angle
from ..core.planner_types import Bits

TIE_RAD = 1e-9  # angles closer than this count as equal: rounding must not choose the gap


class GapHeading(Enum):
    """Heading of gap i: the boundary of sectors i and i+1, or the middle of sector i."""

    BOUNDARY = "boundary"
    MIDDLE = "middle"


@lru_cache(maxsize=64)  # most vectors are free of obstacles
def gap_vector(vs: Bits) -> Bits:
    """Vg of Table 1: b(i) = a(i) or a(i+1); the ring wraps (Fig. 5 closes gap 12 by sector 1)."""
    return tuple([a | b for a, b in zip(vs, vs[1:] + vs[:1])])


def gap_heading(gap: int, count: int, rule: GapHeading = GapHeading.BOUNDARY) -> float:
    """Heading of gap i (from 1) in radians (Fig. 6)."""
    boundary = gap if rule is GapHeading.BOUNDARY else gap - 0.5
    return wrap_angle(2.0 * math.pi * boundary / count)


def nearest_free_gap(
    vg: Bits, goal_heading_rad: float, rule: GapHeading = GapHeading.BOUNDARY
) -> int | None:
    """Number (from 1) of the free gap nearest in angle to the goal; the lower of two equals.

    None when every gap is closed: the robot then stops (not specified in the paper).
    """
    best, smallest = None, math.inf
    for gap, (closed, heading) in enumerate(zip(vg, _headings(len(vg), rule)), start=1):
        if not closed:
            turn = abs(wrap_angle(heading - goal_heading_rad))
            if turn < smallest - TIE_RAD:
                best, smallest = gap, turn
    return best


@cache
def _headings(count: int, rule: GapHeading) -> tuple[float, ...]:
    """gap_heading() of every gap."""
    return tuple(gap_heading(gap, count, rule) for gap in range(1, count + 1))
