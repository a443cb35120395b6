# SPDX-License-Identifier: Apache-2.0
"""Speed limit near obstacles, proportional to the clearance. Not in the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.option_specs import check, option
from ..core.planner_types import Ranges


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedLimitParams:
    """Parameters of the speed limit; off by default, as the paper's robot has one speed."""

    slow_within_m: float = option(
        0.0,
        "clearance below which the speed falls in proportion; 0: no limit",
        unit="m",
        minimum=0.0,
        maximum=1000.0,
    )
    least_share: float = option(
        0.2, "share of the speed allowed at zero clearance", minimum=0.0, maximum=1.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


def allowed_speed_share(ranges_m: Ranges, params: SpeedLimitParams) -> float:
    """Share of the full speed allowed at the clearance of these sectors, in [0, 1].

    clearance / slow_within_m, not below least_share. The clearance is the smallest range,
    measured to enlarged obstacles. 1 when nothing is nearer or the limit is off.
    """
    if params.slow_within_m == 0.0:
        return 1.0
    share = min(ranges_m, default=math.inf) / params.slow_within_m
    return min(1.0, max(params.least_share, share))
