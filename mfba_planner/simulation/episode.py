# SPDX-License-Identifier: Apache-2.0
"""Episode, the record of a run: scenario, parameters, seed, one decision per tick, outcome."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from ..core.geometry import Pose2D
from ..core.planner_types import NANO, Decision
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from .scenario import Scenario
from .triggers import after_triggers


class Outcome(Enum):
    """How a run ended."""

    GOAL_REACHED = "goal_reached"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """A run under any driver: one Decision per tick, the first at tick 0.

    Its scenario says when each trigger was reached: derived from the true poses, if not given.
    """

    scenario: Scenario
    sensor: SensorParams = field(default_factory=SensorParams)
    planner: PlannerParams = field(default_factory=PlannerParams)
    seed: int
    driver: str
    ticks: tuple[Decision, ...]
    outcome: Outcome
    truth: tuple[Pose2D, ...] = ()  # true pose at each tick; (): those of the decisions
    planner_name: str = ""  # the planner, where `planner` (its parameters) does not name it
    start_ns: int | None = None  # stamp at time 0; None: the tick of a simulation, its tick 0

    def __post_init__(self) -> None:
        """Make the scenario that of this run, where obstacles wait for a trigger."""
        poses = self.truth or tuple(tick.pose for tick in self.ticks)
        moments = (
            (self.time_s(tick.stamp_ns), [pose.position]) for tick, pose in zip(self.ticks, poses)
        )
        object.__setattr__(self, "scenario", after_triggers(self.scenario, moments))

    @property
    def label(self) -> str:
        """Name of the planner, for display."""
        return self.planner_name or self.planner.label

    def time_s(self, stamp_ns: int) -> float:
        """Time since the first tick in seconds: t of the obstacles' motion."""
        start_ns = self.planner.tick_ns if self.start_ns is None else self.start_ns
        return (stamp_ns - start_ns) * NANO


def stamp_of(tick: int, tick_ns: int) -> int:
    """Stamp of tick k = 0, 1, ...: (k + 1) tick_ns, since ROS reads a stamp of 0 as unset."""
    return (tick + 1) * tick_ns
