# SPDX-License-Identifier: Apache-2.0
"""Odometry jumps: the pose moved farther than the robot can have driven (kidnapped robot)."""

from __future__ import annotations

import math
from dataclasses import replace

from ..core.geometry import Pose2D, distance
from ..core.planner_types import NANO, Decision, Mode, Observation
from .planner_params import PlannerParams

CARRIED_OFF = "carried off"


class OdometryJump:
    """Compares each pose with the previous one."""

    def __init__(self) -> None:
        """Start without a pose."""
        self._last: tuple[int, Pose2D] | None = None

    def detect(self, obs: Observation, params: PlannerParams, mode: Mode) -> str:
        """The reason why the robot cannot have driven to this pose, "" if it can.

        A jump is a distance above speed times the time since the last pose plus jump_m. Refused
        poses are ignored; a stamp that does not rise is not compared. In mode ARRIVED there is no
        jump: only a new goal makes the robot drive again.
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


def with_odometry_jump(decision: Decision, odometry_jump_reason: str) -> Decision:
    """The decision with the jump's reason in front of its own; unchanged for ""."""
    return (
        replace(decision, reason=f"{odometry_jump_reason}; {decision.reason}")
        if odometry_jump_reason
        else decision
    )


def is_odometry_jump(reason: str) -> bool:
    """Whether a decision's reason reports an odometry jump."""
    return reason.startswith(CARRIED_OFF)
