# SPDX-License-Identifier: Apache-2.0
"""Candidate waypoints of the predictive planner among circles."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..core.geometry import Point
from ..core.planner_types import Bits
from .trajectory_cost import Candidate

LENGTHS = (0.25, 0.5, 0.75, 1.0)  # distances of a gap's waypoints, in reach_m
WAITS_S = (0.4, 0.8, 1.4, 2.0, 3.0)
SPEEDS = (1e-6, 0.5)  # while waiting, as share of full speed; not 0: a direction is needed
HEADINGS_IF_CLOSED = 12  # headings evaluated when all are closed
_FREE_M = 1e-9


def nearest_free(closed: Bits, to_goal: Point) -> list[int]:
    """The free headings nearest to the goal's on both sides; every sixth if none is free."""
    n = len(closed)
    if 0 not in closed:
        return list(range(0, n, n // HEADINGS_IF_CLOSED))
    above = math.floor(math.atan2(to_goal[1], to_goal[0]) * n / (2.0 * math.pi)) % n
    around = closed[above:] + closed[:above]
    left, right = around.index(0), n - 1 - around[::-1].index(0)
    return [(above + k) % n for k in sorted({left, right})]


class CandidateWaypoints:
    """Waypoints along the headings of gaps, and on the straight line after waiting."""

    def __init__(self, cos: Sequence[float], sin: Sequence[float], reach_m: float) -> None:
        """The headings are given by their cosines and sines."""
        lengths = [share * reach_m for share in LENGTHS]
        self._rays = [
            [((c * length, s * length), length) for length in lengths] for c, s in zip(cos, sin)
        ]

    def of(
        self, gaps: list[int], to_goal: Point, goal_distance: float, speed: float, waiting: float
    ) -> list[Candidate]:
        """Candidates, numbered by heading, or from their number on for those with waiting.

        They are sorted by their least possible cost, so that most need no evaluation.
        """
        (gx, gy), candidates = to_goal, []
        for k in gaps:
            for q, length in self._rays[k]:
                rx, ry = gx - q[0], gy - q[1]
                candidates.append((length + math.sqrt(rx * rx + ry * ry), q, length / speed, k))
        ex, ey = gx / goal_distance * speed, gy / goal_distance * speed
        for number, share in enumerate(SPEEDS, len(self._rays)):
            for t in WAITS_S:
                lower = goal_distance + waiting * speed * t * (1.0 - share)
                candidates.append((lower - _FREE_M, (ex * share * t, ey * share * t), t, number))
        candidates.sort()
        return candidates
