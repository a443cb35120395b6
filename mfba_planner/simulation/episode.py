# SPDX-License-Identifier: Apache-2.0
"""The one currency: a run as scenario, parameters, seed and ticks; and the core driver."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from ..core.geometry import Pose2D
from ..core.types import NANO, Decision
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from .scenario import Scenario


class Outcome(Enum):
    """How a run ended."""

    GOAL_REACHED = "goal_reached"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """A run, whatever drove it: one Decision per tick, the first at tick 0."""

    scenario: Scenario
    sensor: SensorParams = field(default_factory=SensorParams)
    planner: PlannerParams = field(default_factory=PlannerParams)
    seed: int
    driver: str
    ticks: tuple[Decision, ...]
    outcome: Outcome
    truth: tuple[Pose2D, ...] = ()  # where the robot was at each tick; (): where it saw itself
    planner_name: str = ""  # who decided, where that is not what planner's own options name

    @property
    def label(self) -> str:
        """Who decided, for people."""
        return self.planner_name or self.planner.label

    def time_s(self, stamp_ns: int) -> float:
        """Time since the first tick in seconds, the t of the obstacles' motion."""
        return (stamp_ns - self.planner.tick_ns) * NANO


def stamp_of(tick: int, tick_ns: int) -> int:
    """Stamp of tick k = 0, 1, ...: (k + 1) tick_ns, since ROS reads a stamp of 0 as unset."""
    return (tick + 1) * tick_ns
