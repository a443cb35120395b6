# SPDX-License-Identifier: Apache-2.0
"""Slower where it is narrow: a speed limit that falls with the clearance. Not the paper's."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.options import check, option
from ..core.types import Ranges


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedLimitParams:
    """When to slow down; off by default, as the paper's robot has one speed."""

    slow_within_m: float = option(
        0.0,
        "clearance below which the speed falls in proportion; 0: never",
        unit="m",
        minimum=0.0,
        maximum=1000.0,
    )
    least_share: float = option(
        0.2, "share of the speed that is left at no clearance at all", minimum=0.0, maximum=1.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


def allowed_speed_share(ranges_m: Ranges, params: SpeedLimitParams) -> float:
    """Share of the full speed allowed at the clearance of these sectors, in [0, 1].

    clearance / slow_within_m, not below least_share; the clearance is the least range, which is
    measured to enlarged obstacles. 1 where nothing is seen nearer, and where it is switched off.
    """
    if params.slow_within_m == 0.0:
        return 1.0
    share = min(ranges_m, default=math.inf) / params.slow_within_m
    return min(1.0, max(params.least_share, share))
