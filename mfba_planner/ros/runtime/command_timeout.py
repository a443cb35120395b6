# SPDX-License-Identifier: Apache-2.0
"""How long a robot obeys the last Twist, as cmd_vel_timeout of ros2_control. No ROS here."""

from __future__ import annotations

from ...core.types import NANO
from ..node_parameters import WorldSimSettings

TICKS = 1.25  # a Twist is meant for a tick: that long it always holds


class CommandTimeout:
    """Real time: after cmd_vel_timeout_s of silence, but no less than a tick, the robot rests."""

    def __init__(self, settings: WorldSimSettings) -> None:
        """Start with nothing heard."""
        tick_s = settings.tick_ns * NANO / settings.speed_factor
        self._timeout_s = max(settings.cmd_vel_timeout_s, TICKS * tick_s)
        self._on = settings.cmd_vel_timeout_s > 0.0
        self._heard_s = 0.0

    def heard(self, now_s: float) -> None:
        """A Twist came; now_s is of any steady clock."""
        self._heard_s = now_s

    def has_expired(self, now_s: float) -> bool:
        """Whether the last Twist is too old to be obeyed."""
        return self._on and now_s - self._heard_s > self._timeout_s
