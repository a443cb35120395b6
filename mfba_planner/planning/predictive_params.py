# SPDX-License-Identifier: Apache-2.0
"""Options of the predictive planner."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..core.option_specs import check, option
from ..perception.obstacle_memory import ObstacleMemoryParams
from ..perception.obstacle_tracker import TrackingParams
from ..perception.static_map import StaticMapParams
from .distance_to_go import RouteParams
from .trajectory_cost import RiskParams


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictiveParams:
    """Options of the predictive planner in addition to PlannerParams."""

    headings: int = option(72, "number of headings, one bit each", minimum=12, maximum=3600)
    reach_m: float = option(
        2.5, "largest distance of a waypoint", unit="m", minimum=0.01, maximum=100.0
    )
    search_m: float = option(
        0.3, "radius of the disc the bats search", unit="m", minimum=0.001, maximum=100.0
    )
    sector_radius_m: float = option(
        0.3,
        "radius of the circle that replaces a set sector",
        unit="m",
        minimum=0.01,
        maximum=10.0,
    )
    coverage_s: float = option(
        1.0, "time for which an observed direction stays observed", unit="s", minimum=0.0,
        maximum=60.0,
    )  # fmt: skip
    memory: ObstacleMemoryParams = field(default_factory=ObstacleMemoryParams)
    tracking: TrackingParams = field(default_factory=TrackingParams)
    map: StaticMapParams = field(default_factory=StaticMapParams)
    route: RouteParams = field(default_factory=RouteParams)
    risk: RiskParams = field(default_factory=RiskParams)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
