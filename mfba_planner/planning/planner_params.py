# SPDX-License-Identifier: Apache-2.0
"""Options of every planner: which one, its speed and step, the swarm, recovery."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from ..core.options import check, option
from ..core.types import NANO
from ..swarm.bat_swarm import BatParams
from .gap_vector import GapHeading
from .recovery import RecoveryParams
from .speed_limit import SpeedLimitParams


class Method(Enum):
    """Who decides on sectors: Algorithm 1, or the planner that predicts (predictive.py)."""

    PAPER = "paper"
    PREDICTIVE = "predictive"


class Swarm(Enum):
    """Fresh bats in the step's disc at every step, or one swarm that lives over the trip."""

    FRESH = "fresh"
    PERSISTENT = "persistent"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParams:
    """The reading `section6` of Algorithm 1 and section 6.2."""

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
    speed_mps: float = option(0.785, "robot speed", unit="m/s", minimum=0.01, maximum=100.0)
    step_length_m: float = option(
        0.3, "longest goal step, in both modes", unit="m", minimum=0.001, maximum=100.0
    )
    goal_tolerance_m: float = option(
        0.02, "distance at which the goal counts as reached", unit="m", minimum=1e-6, maximum=10.0
    )
    input_timeout_s: float = option(
        1.0, "age at which odometry or sectors are stale", unit="s", minimum=0.001, maximum=3600.0
    )
    gap_heading: GapHeading = option(GapHeading.BOUNDARY, "where a gap leads, in its two sectors")
    swarm: Swarm = option(Swarm.FRESH, "fresh bats per step, or one persistent swarm (Fig. 1)")
    bat: BatParams = field(default_factory=BatParams)
    speed_limit: SpeedLimitParams = field(default_factory=SpeedLimitParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)

    @property
    def label(self) -> str:
        """Who decides, for people: the law of beta in Algorithm 1, or the other method."""
        paper = self.method is Method.PAPER
        return self.bat.algorithm.value if paper else self.method.value

    @property
    def tick_ns(self) -> int:
        """Duration of one decision, step length / speed, in whole nanoseconds."""
        return round(self.step_length_m / self.speed_mps / NANO)

    @property
    def tracks_scan(self) -> bool:
        """Whether it wants the scan beside the sectors."""
        return self.method is Method.PREDICTIVE and self.scan_radius_m > 0.0
