# SPDX-License-Identifier: Apache-2.0
"""How long a robot follows the last Twist, as cmd_vel_timeout of ros2_control. No ROS here."""

from __future__ import annotations

from ...core.planner_types import NANO
from ..node_settings import WorldSimSettings

TICKS = 1.25  # a Twist is meant for one tick: it holds at least that long


class CommandTimeout:
    """Real time: the robot stops cmd_vel_timeout_s after the last Twist, but not within a tick."""

    def __init__(self, settings: WorldSimSettings) -> None:
        """Start with nothing received."""
        tick_s = settings.tick_ns * NANO / settings.speed_factor
        self._timeout_s = max(settings.cmd_vel_timeout_s, TICKS * tick_s)
        self._enabled = settings.cmd_vel_timeout_s > 0.0
        self._received_s = 0.0

    def received(self, now_s: float) -> None:
        """A Twist was received; now_s is of any steady clock."""
        self._received_s = now_s

    def has_expired(self, now_s: float) -> bool:
        """Whether the last Twist is too old to be followed."""
        return self._enabled and now_s - self._received_s > self._timeout_s
