# SPDX-License-Identifier: Apache-2.0
"""Parameters of all planners: method, speed, goal step, swarm, speed limit, recovery, progress."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from enum import Enum

from ..core.errors import ConfigError
from ..core.option_specs import check, option
from ..core.planner_types import NANO, ROBOT_RADIUS_M
from ..core.robot_base import Base
from ..optimizers.registry import BATS
from ..swarm.bat_swarm import BatParams
from .gap_vector import GapHeading
from .progress_checker import ProgressParams
from .recovery import RecoveryParams
from .speed_limit import SpeedLimitParams


class Method(Enum):
    """The planner: Algorithm 1, or the predictive planner (predictive.py)."""

    PAPER = "paper"
    PREDICTIVE = "predictive"


class PerceptionInput(Enum):
    """What the predictive planner perceives obstacles by; auto: a scan wherever there is one."""

    AUTO = "auto"
    SCAN = "scan"
    SECTORS = "sectors"


class Swarm(Enum):
    """A fresh swarm at every goal step, or one persistent swarm for the trip."""

    FRESH = "fresh"
    PERSISTENT = "persistent"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParams(Base):
    """The reading `section6` of Algorithm 1 and section 6.2, and the robot it plans for.

    In a run the robot's radius, drive and limits are the scenario's; see for_robot().
    """

    method: Method = option(Method.PAPER, "Algorithm 1 of the paper, or our predictive planner")
    jump_m: float = option(
        0.5,
        "distance beyond what speed_mps allows that counts as an odometry jump",
        unit="m",
        minimum=0.01,
        maximum=1e6,
    )
    perception: PerceptionInput = option(
        PerceptionInput.AUTO,
        "predictive: obstacles from the scan or from the sectors; auto: the scan if there is one",
    )
    known_map: bool = option(
        False, "predictive: find ways by a map known before (topic map, or the scenario's walls)"
    )
    robot_radius_m: float = option(
        ROBOT_RADIUS_M,
        "radius of the robot: every obstacle is enlarged by it (Fig. 4)",
        unit="m",
        minimum=0.0,
        maximum=100.0,
    )
    speed_mps: float = option(0.785, "robot speed", unit="m/s", minimum=0.01, maximum=100.0)
    step_length_m: float = option(
        0.3, "longest goal step, in both modes", unit="m", minimum=0.001, maximum=100.0
    )
    goal_tolerance_m: float = option(
        0.02, "distance at which the goal counts as reached", unit="m", minimum=1e-6, maximum=10.0
    )
    input_timeout_s: float = option(
        1.0,
        "age at which odometry, sectors or scan are stale, since their arrival or by their stamps",
        unit="s",
        minimum=0.001,
        maximum=3600.0,
    )
    gap_heading: GapHeading = option(
        GapHeading.BOUNDARY,
        "heading of a gap: boundary of its two sectors, or middle of the first",
    )
    swarm: Swarm = option(
        Swarm.FRESH, "fresh swarm per goal step, or one persistent swarm (Fig. 1)"
    )
    optimizer: str = option(
        BATS,
        "what searches for waypoints: bats (as bat.* says), random, grid, none (no search), a "
        "library's such as niapy:ParticleSwarmAlgorithm, or MODULE:NAME; with as many evaluations",
    )
    bat: BatParams = field(default_factory=BatParams)
    speed_limit: SpeedLimitParams = field(default_factory=SpeedLimitParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)
    progress: ProgressParams = field(default_factory=ProgressParams)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range, or options that contradict each other."""
        check(self)
        if self.perception is PerceptionInput.SCAN and self.method is Method.PAPER:
            raise ConfigError(
                "perception=scan: method=paper reads sectors only; give auto, or method=predictive"
            )
        if self.swarm is Swarm.PERSISTENT and self.optimizer != BATS:
            raise ConfigError(
                f"swarm=persistent: optimizer={self.optimizer} starts anew at each goal step; "
                f"give swarm=fresh, or optimizer={BATS}"
            )

    @property
    def label(self) -> str:
        """Name of the planner for output: ba or mfba for Algorithm 1, else the method.

        With another optimiser than the bats: the method and the optimiser.
        """
        if self.optimizer != BATS:
            return f"{self.method.value} with {self.optimizer}"
        paper = self.method is Method.PAPER
        return self.bat.algorithm.value if paper else self.method.value

    @property
    def tick_ns(self) -> int:
        """Duration of one decision, step length / speed, in whole nanoseconds."""
        return round(self.step_length_m / self.speed_mps / NANO)

    @property
    def reads_scan(self) -> bool:
        """Whether the planner uses a scan, if there is one, in addition to the sectors."""
        return self.method is Method.PREDICTIVE and self.perception is not PerceptionInput.SECTORS

    @property
    def reads_known_map(self) -> bool:
        """Whether the planner waits for a known map; without a scan it would not use it."""
        return self.known_map and self.reads_scan

    def for_robot(self, radius_m: float, base: Base) -> PlannerParams:
        """These options for a robot of that radius, drive and limits."""
        return replace(
            self,
            robot_radius_m=radius_m,
            **{item.name: getattr(base, item.name) for item in fields(Base)},
        )
