# SPDX-License-Identifier: Apache-2.0
"""Planners with a fault from tick 5 on, one kind per class."""

import math
import os
import time
from dataclasses import replace
from typing import Any

from mfba_planner.core.planner_types import Decision, Observation
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.peers.straight_line import Straight
from mfba_planner.planning.planner_params import PlannerParams

NORMAL_TICKS = 5


class Faulty(Straight):
    """Drives straight, then fails."""

    def __init__(self, params: PlannerParams, sensor: SensorParams, seed: int) -> None:
        super().__init__(params, sensor, seed)
        self.tick = 0

    def plan(self, obs: Observation) -> Decision:
        decision = super().plan(obs)
        self.tick += 1
        return decision if self.tick <= NORMAL_TICKS else self.wrong(decision)

    def wrong(self, decision: Decision) -> Any:
        raise NotImplementedError


class Raises(Faulty):
    def wrong(self, decision: Decision) -> Any:
        raise ValueError("no idea\nwhat to do")


class NotANumber(Faulty):
    def wrong(self, decision: Decision) -> Any:
        return replace(decision, velocity=(math.nan, 0.0))


class TooFast(Faulty):
    def wrong(self, decision: Decision) -> Any:
        vx, vy = decision.velocity
        return replace(decision, velocity=(1.01 * vx, 1.01 * vy))


class Nothing(Faulty):
    def wrong(self, decision: Decision) -> Any:
        return None


class OldStamp(Faulty):
    def wrong(self, decision: Decision) -> Any:
        return replace(decision, stamp_ns=1)


class OneNumber(Faulty):
    def wrong(self, decision: Decision) -> Any:
        velocity: Any = 3.0
        return replace(decision, velocity=velocity)


class Hangs(Faulty):
    """Hangs with seed 1, and ignores the exception of a signal."""

    def wrong(self, decision: Decision) -> Any:
        while self.seed == 1:
            try:
                time.sleep(3600.0)
            except BaseException:
                continue
        return decision


class Dies(Faulty):
    """Ends its process with seed 1, as a crash in machine code would."""

    def wrong(self, decision: Decision) -> Any:
        if self.seed == 1:
            os._exit(7)
        return decision


class Sleeps(Faulty):
    """Hangs until its sleep is interrupted."""

    def wrong(self, decision: Decision) -> Any:
        time.sleep(3600.0)
        return decision


class Unmakeable(Straight):
    def __init__(self, params: PlannerParams, sensor: SensorParams, seed: int) -> None:
        if seed:
            raise KeyError("seed")
        super().__init__(params, sensor, seed)


class TwoArguments:
    """As a factory it takes too few arguments."""

    def __init__(self, params: PlannerParams, sensor: SensorParams) -> None:
        """Nothing."""

    def plan(self, obs: Observation) -> Decision:
        raise NotImplementedError


class WithoutPlan:
    """Takes what a planner takes, and has no plan()."""

    def __init__(self, *_: object) -> None:
        """Nothing."""


class PlanWithoutInput(WithoutPlan):
    def plan(self) -> None:
        """Takes no observation."""


class WrongInputs(WithoutPlan):
    inputs = 5

    def plan(self, obs: Observation) -> Decision:
        raise NotImplementedError


class WrongPreset(WithoutPlan):
    preset = len

    def plan(self, obs: Observation) -> Decision:
        raise NotImplementedError


def makes_nothing(*_: object) -> None:
    """A factory that forgets to return its planner."""


def makes_a_class(*_: object) -> type[Straight]:
    return Straight
