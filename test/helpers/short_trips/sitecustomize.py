# SPDX-License-Identifier: Apache-2.0
"""In each Python process with this directory on its path, trips of named suites end soon.

For tests of what is made of many runs, not of the runs: a trip of 17 m costs ten times as much.
"""

import math
from dataclasses import replace

from mfba_planner.evaluation.suites.named_suites import Suite
from mfba_planner.simulation.scenario import Scenario

LENGTH_M, LIMIT_S = 1.0, 3.0

_whole = Suite.world


def _begun(suite: Suite, k: int, speed_mps: float | None = None) -> Scenario:
    """World k, with a goal on the straight line to its own."""
    whole = _whole(suite, k, speed_mps)
    share = LENGTH_M / math.dist(whole.start_m, whole.goal_m)
    x, y = (a + share * (b - a) for a, b in zip(whole.start_m, whole.goal_m))
    return replace(whole, goal_m=(x, y), time_limit_s=LIMIT_S)


Suite.world = _begun  # type: ignore[assignment, method-assign]
