# SPDX-License-Identifier: Apache-2.0
"""What a robot is told by its planner: by every Twist, or by the one that answers a stamp."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TwistStamped

from ...core.errors import InputError
from ...core.geometry import Point
from ...recording.from_messages import stamp_ns, told
from ...simulation.world import World
from ..interface import topics
from ..interface.serialized_message import header_stamp_ns
from ..node_parameters import WorldSimSettings
from ..runtime.command_matching import CommandMatching
from ..runtime.command_timeout import CommandTimeout
from ..runtime.node_runtime import GraphNode, Refusals
from ..runtime.polled_subscriptions import PolledSubscriptions, SerializedMessage
from .robot_namespace import NamespacedNode

REST: Point = (0.0, 0.0)


class CommandSubscriptions:
    """The subscriptions of world_sim to cmd_vel and goal_step, and what they have told last."""

    def __init__(
        self,
        node: GraphNode | NamespacedNode,
        settings: WorldSimSettings,
        world: Callable[[], World],
        refusals: Refusals,
        on_heard: Callable[[], None],
    ) -> None:
        """Subscribe for the robot of a world; in lockstep on_heard says that a Twist has come."""
        self.told: Point = REST  # as World.step takes it
        self._settings = settings
        self._world = world
        self._refusals = refusals
        self._on_heard = on_heard
        self._command_matching = CommandMatching()
        self._command_timeout = CommandTimeout(settings)
        stamped = TwistStamped if settings.enable_stamped_cmd_vel else None
        node.listen(topics.CMD_VEL, self._on_cmd_vel, stamped)
        # Looked into when a Twist has come: nothing more to wake up for.
        self._goal_steps = PolledSubscriptions()
        step = topics.GOAL_STEP
        node.subscribe_polled(
            self._goal_steps, step.type, step.name, self._on_goal_step, [step.qos]
        )

    def take(self, stamp: int) -> bool:
        """Lockstep: whether the Twist that answers this stamp has come, once; it is obeyed."""
        if not self._settings.enable_stamped_cmd_vel:
            self._goal_steps.empty()
        message = self._command_matching.take(stamp)
        if message is not None:
            self._obey(message)
        return message is not None

    def rest(self) -> None:
        """Forget what was told."""
        self.told = REST

    def rest_if_silent(self) -> None:
        """Real time: forget what was told too long ago."""
        if self._command_timeout.has_expired(time.monotonic()):
            self.rest()

    def _obey(self, message: Any) -> None:
        """Do what a Twist says, and rest where it cannot be meant."""
        self.rest()
        world = self._world()
        try:
            self.told = told(message, world.scenario.robot, world.pose.yaw)
        except InputError as error:
            self._refusals.add(error)

    def _on_cmd_vel(self, message: Any, info: Any) -> None:
        if not self._settings.lockstep:
            self._command_timeout.heard(time.monotonic())
            self._obey(message)
            return
        sent_ns = info["source_timestamp"]
        if self._settings.enable_stamped_cmd_vel:
            self._command_matching.goal_step(stamp_ns(message.header.stamp), sent_ns)
        self._command_matching.cmd_vel(message, sent_ns)
        self._on_heard()

    def _on_goal_step(self, message: SerializedMessage) -> None:
        self._command_matching.goal_step(header_stamp_ns(message.data), message.sent_ns)
