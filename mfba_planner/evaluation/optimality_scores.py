# SPDX-License-Identifier: Apache-2.0
"""Scores of a run against an optimum: optimality gap, SPL, BARN score."""

from __future__ import annotations

import math

from ..simulation.episode import Outcome
from .metrics import Result

BARN_FASTEST, BARN_SLOWEST = 2.0, 8.0  # multiples of the optimal time


def time_to_goal_s(result: Result) -> float:
    """Simulated time until the goal was reached; inf when it was not."""
    return result.time_s if result.outcome is Outcome.GOAL_REACHED else math.inf


def optimality_gap(length_m: float, optimum_m: float) -> float:
    """Gap to the optimum, length / optimum - 1; valid where the goal was reached.

    Negative for a run that ended within the goal tolerance, or that collided.
    """
    return length_m / optimum_m - 1.0


def spl(success: bool, length_m: float, optimum_m: float) -> float:
    """Success weighted by path length: S optimum / max(length, optimum), in [0, 1].

    S is 1 for a success, else 0 (Anderson et al. 2018, one term of the mean).
    """
    return optimum_m / max(length_m, optimum_m) if success else 0.0


def barn_score(success: bool, time_s: float, optimum_s: float) -> float:
    """Score of the BARN challenge: S OT / clip(AT, 2 OT, 8 OT), in [0, 0.5].

    OT is the time of the optimal path at the robot's full speed, AT the time the run took, S as
    in spl. (In 2022 the lower bound was 4 OT.)
    """
    if not success:
        return 0.0
    return optimum_s / min(BARN_SLOWEST * optimum_s, max(BARN_FASTEST * optimum_s, time_s))
