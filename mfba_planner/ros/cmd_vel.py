# SPDX-License-Identifier: Apache-2.0
"""cmd_vel as the base drives it: its parameters, with or without a stamp."""

from __future__ import annotations

from geometry_msgs.msg import TwistStamped

from ..core.planner import Decision
from ..core.robot import Base
from ..node_settings import PlannerSettings
from . import convert, params, topics
from .runtime import GraphNode


class CmdVel:
    """The publisher of cmd_vel; declares the base's parameters."""

    def __init__(self, node: GraphNode, settings: PlannerSettings) -> None:
        """Raise ConfigError for a base that cannot be accepted."""
        self.base = params.declare(node, Base(), read_only=True)
        self._frame = settings.base_frame if settings.enable_stamped_cmd_vel else None
        self._out = node.advertise(topics.CMD_VEL, TwistStamped if self._frame else None)

    def publish(self, decision: Decision, tick_ns: int) -> None:
        """Say what the base is to do for the next tick."""
        if self._frame is None:
            self._out.publish(convert.twist_msg(decision, self.base, tick_ns))
        else:
            twist = convert.twist_stamped_msg(decision, self._frame, self.base, tick_ns)
            self._out.publish(twist)
