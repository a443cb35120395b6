# SPDX-License-Identifier: Apache-2.0
"""The kidnapped robot: odometry that moved farther than the robot can have driven."""

from __future__ import annotations

import math
from dataclasses import replace

from ..core.geometry import Pose2D, distance
from ..core.types import NANO, Decision, Mode, Observation
from .planner_params import PlannerParams

CARRIED_OFF = "carried off"


class OdometryJump:
    """Compares each pose with the one before it."""

    def __init__(self) -> None:
        """Start before the first pose."""
        self._last: tuple[int, Pose2D] | None = None

    def detect(self, obs: Observation, params: PlannerParams, mode: Mode) -> str:
        """Why the robot cannot have driven here, "" where it can.

        Farther than its speed times the time since the last pose plus jump_m is too far. A pose
        that was refused says nothing; stamps that go back begin anew. Who has arrived stays where
        it is put: only a new goal makes it drive again.
        """
        if obs.refused or not all(map(math.isfinite, obs.pose)):
            return ""
        last, self._last = self._last, (obs.stamp_ns, obs.pose)
        if last is None or obs.stamp_ns <= last[0]:
            return ""
        took_s = (obs.stamp_ns - last[0]) * NANO
        moved_m = distance(last[1].position, obs.pose.position)
        if not moved_m > params.speed_mps * took_s + params.jump_m or mode is Mode.ARRIVED:
            return ""
        return f"{CARRIED_OFF} {moved_m:.3g} m in {took_s:.3g} s, beginning anew"


def with_jump_reason(decision: Decision, carried: str) -> Decision:
    """The decision, its reason preceded by how the robot came where it is."""
    return replace(decision, reason=f"{carried}; {decision.reason}") if carried else decision


def is_jump_reason(reason: str) -> bool:
    """Whether a decision's reason says that the robot was carried to where it is."""
    return reason.startswith(CARRIED_OFF)
