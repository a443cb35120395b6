# SPDX-License-Identifier: Apache-2.0
"""Who plans, and what it makes of odometry and scan."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..core.options import option


class Method(Enum):
    """Who decides on sectors: Algorithm 1, or the planner that predicts (planners/)."""

    PAPER = "paper"
    PREDICTIVE = "predictive"


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenParams:
    """Options of planning.algorithm_1.PlannerParams; checked there."""

    method: Method = option(Method.PAPER, "Algorithm 1, or our planner that predicts")
    jump_m: float = option(
        0.5,
        "odometry that moved so much farther than speed_mps allows: carried off",
        unit="m",
        minimum=0.01,
        maximum=1e6,
    )
    scan_radius_m: float = option(
        0.0,
        "predictive: stay so far from what the scan shows, tracked; 0: decide on sectors",
        unit="m",
        minimum=0.0,
        maximum=10.0,
    )

    @property
    def tracks_scan(self) -> bool:
        """Whether it wants the scan beside the sectors."""
        return self.method is Method.PREDICTIVE and self.scan_radius_m > 0.0
