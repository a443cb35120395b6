# SPDX-License-Identifier: Apache-2.0
"""What a planner makes of odometry and scan, whoever it is."""

from __future__ import annotations

from dataclasses import dataclass

from .options import option


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenParams:
    """Options of core.planner.PlannerParams; checked there."""

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
