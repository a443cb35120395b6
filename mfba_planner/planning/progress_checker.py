# SPDX-License-Identifier: Apache-2.0
"""Progress of a trip: nearer to the goal, or on new ground. Not in the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.geometry import distance
from ..core.option_specs import check, option
from ..core.planner_types import NANO, Decision


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgressParams:
    """When a robot that drives counts as making no progress; on by default."""

    time_allowance_s: float = option(
        40.0,
        "driving time without progress after which the robot stops and replans; 0: no limit",
        unit="s",
        minimum=0.0,
        maximum=86400.0,
    )
    detour_allowance_s: float = option(
        300.0,
        "driving time in which new ground counts as progress, though not nearer to the goal",
        unit="s",
        minimum=0.0,
        maximum=86400.0,
    )
    nearer_m: float = option(
        0.1,
        "progress: nearer to the goal than ever by this distance",
        unit="m",
        minimum=0.001,
        maximum=100.0,
    )
    cell_m: float = option(
        0.5,
        "new ground: a square of this size that the robot has not been in",
        unit="m",
        minimum=0.001,
        maximum=100.0,
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class ProgressChecker:
    """Counts the driving time of a trip since its last progress.

    Only time between two decisions that drive counts: a robot that is blocked, or stopped for
    lack of inputs, rests and says so already. New ground is counted by the squares of a grid
    that the robot has been in since it was last nearer to the goal, so that a long detour is
    progress, and driving to and fro is not. As the detour is limited, so is the memory.
    """

    def __init__(self) -> None:
        """Start a trip."""
        self._least_m = math.inf  # distance to the goal
        self._last_ns: int | None = None  # stamp of the last decision, if it drove
        self._squares: set[tuple[float, float]] = set()
        self._idle_ns = 0  # driving time since the last progress
        self._detour_ns = 0  # driving time since it was last nearer to the goal
        self.tries = 0  # restarts since it was last nearer to the goal

    def pause(self) -> None:
        """The robot does not drive by this decision."""
        self._last_ns = None

    def restart(self) -> None:
        """Allow the full time again, for another try."""
        self._last_ns, self._idle_ns = None, 0
        self.tries += 1

    def check(self, decision: Decision, params: ProgressParams) -> str:
        """Take a decision that drives; the reason why it makes no progress, "" if it does."""
        if decision.goal is None or params.time_allowance_s == 0.0:
            return ""
        if self._last_ns is not None:
            passed_ns = max(decision.stamp_ns - self._last_ns, 0)
            self._idle_ns += passed_ns
            self._detour_ns += passed_ns
        self._last_ns = decision.stamp_ns
        remaining_m = distance(decision.pose.position, decision.goal)
        square = (decision.pose.x // params.cell_m, decision.pose.y // params.cell_m)
        if remaining_m <= self._least_m - params.nearer_m:
            self._least_m = remaining_m
            self._squares = {square}
            self._idle_ns = self._detour_ns = self.tries = 0
            return ""
        detour_s = self._detour_ns * NANO
        if square not in self._squares and detour_s <= params.detour_allowance_s:
            self._squares.add(square)
            self._idle_ns = 0
        if self._idle_ns * NANO < params.time_allowance_s:
            return ""
        nearer_m = max(self._least_m - remaining_m, 0.0)
        reason = f"no progress: {nearer_m:.2f} m nearer to the goal in {detour_s:.0f} s of driving"
        if detour_s <= params.detour_allowance_s:
            reason += f", no new ground in {self._idle_ns * NANO:.0f} s"
        return reason
