# SPDX-License-Identifier: Apache-2.0
"""Sandbox for untrusted planners: every decision is checked before the robot moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from inspect import signature
from time import perf_counter_ns

from ...core.errors import MfbaError
from ...core.planner_types import Decision, Observation, PathPlanner
from ...planning.planner_params import PlannerParams

SPEED_SLACK = 1e-6  # a tick is a whole number of nanoseconds


class PlannerFault(Exception):  # noqa: N818
    """A fault of a planner that ends its run; its text says which."""


class HungError(BaseException):
    """A planner hung until an alarm; a BaseException, so that the planner does not catch it."""


class PlannerSandbox:
    """Checks and records the decisions of a planner; raises PlannerFault for an invalid one.

    decisions holds the valid ones, times_ns the wall time of each; planner is None before take().
    """

    def __init__(self, params: PlannerParams) -> None:
        """Start without a planner, with its parameters."""
        self.planner: PathPlanner | None = None
        self._limit_mps = params.speed_mps * (1.0 + SPEED_SLACK)
        self.decisions: list[Decision] = []
        self.times_ns: list[int] = []

    def make_planner(self, make: Callable[[], PathPlanner]) -> PathPlanner:
        """Make and return the planner. Raises PlannerFault; MfbaError is passed on."""
        try:
            self.planner = made = make()
        except MfbaError:
            raise
        except Exception as error:
            raise PlannerFault(_raised(error)) from error
        if fault := fault_of_planner(made):
            raise PlannerFault(fault)
        return made

    def plan(self, obs: Observation) -> Decision:
        """The planner's decision. Raises PlannerFault for an invalid one."""
        assert self.planner is not None
        start_ns = perf_counter_ns()
        try:
            decision = self.planner.plan(obs)
        except Exception as error:
            raise PlannerFault(_raised(error)) from error
        self.times_ns.append(perf_counter_ns() - start_ns)
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


def fault_of_planner(made: object) -> str:
    """Why what a factory has made is no planner, "" if it is one."""
    plan = getattr(made, "plan", None)
    if isinstance(made, type) or not callable(plan):
        name = f"the class {made.__name__}" if isinstance(made, type) else type(made).__name__
        return f"the factory made {name}, which has no method plan(observation)"
    with suppress(ValueError):  # of some functions in C nothing is known
        try:
            signature(plan).bind(None)
        except TypeError as error:
            return f"its method plan cannot be called with an observation ({error})"
    return ""


def _raised(error: Exception) -> str:
    return f"raised {type(error).__name__}: {' '.join(str(error).split())[:200]}"
