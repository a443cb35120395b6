# SPDX-License-Identifier: Apache-2.0
"""A planner that is not trusted: every decision is looked at before the robot moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter_ns

from ...core.errors import MfbaError
from ...core.types import Decision, Observation, PathPlanner
from ...planning.planner_params import PlannerParams

SPEED_SLACK = 1e-6  # a tick is a whole number of nanoseconds


class PlannerFault(Exception):  # noqa: N818
    """What a planner did that ends its run, in words."""


class HungError(BaseException):
    """An alarm went off while a planner decided; no `except Exception` of its own stops it."""


class PlannerSandbox:
    """Passes on what a planner decides; PlannerFault where it must not be followed.

    decisions are those that were followed, times_ns what each took by the machine's clock, and
    planner who decides, None before take().
    """

    def __init__(self, params: PlannerParams) -> None:
        """Start without a planner, with what it was told."""
        self.planner: PathPlanner | None = None
        self._limit_mps = params.speed_mps * (1.0 + SPEED_SLACK)
        self.decisions: list[Decision] = []
        self.times_ns: list[int] = []

    def take(self, make: Callable[[], PathPlanner]) -> PathPlanner:
        """Make the planner; return it. Raises PlannerFault, and MfbaErrors as they are."""
        try:
            self.planner = made = make()
        except MfbaError:
            raise
        except Exception as error:
            raise PlannerFault(_raised(error)) from error
        return made

    def plan(self, obs: Observation) -> Decision:
        """Ask the planner. Raises PlannerFault."""
        assert self.planner is not None
        begun = perf_counter_ns()
        try:
            decision = self.planner.plan(obs)
        except Exception as error:
            raise PlannerFault(_raised(error)) from error
        self.times_ns.append(perf_counter_ns() - begun)
        fault = self._fault(decision, obs)
        if fault:
            raise PlannerFault(fault)
        self.decisions.append(decision)
        return decision

    def _fault(self, decision: object, obs: Observation) -> str:
        if not isinstance(decision, Decision):
            return f"returned {type(decision).__name__}, not a Decision"
        if decision.stamp_ns != obs.stamp_ns:
            return f"answered stamp {decision.stamp_ns} instead of {obs.stamp_ns}"
        try:
            vx, vy = decision.velocity
            speed = math.hypot(vx, vy)
        except (TypeError, ValueError):
            return f"velocity {decision.velocity!r} is not two numbers"
        if not math.isfinite(speed):
            return f"velocity ({vx}, {vy}) is not finite"
        if speed > self._limit_mps:
            return f"speed {speed:.4g} m/s exceeds the limit of {self._limit_mps:.4g} m/s"
        return ""


def _raised(error: Exception) -> str:
    return f"raised {type(error).__name__}: {' '.join(str(error).split())[:200]}"
