# SPDX-License-Identifier: Apache-2.0
"""world_sim's cmd_vel and goal_step of one robot: the command that the robot follows."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TwistStamped

from ...core.errors import InputError
from ...core.geometry import Point
from ...recording.from_messages import command_from_twist, stamp_ns
from ...simulation.world import World
from ..interface import topics
from ..interface.serialized_message import header_stamp_ns
from ..node_settings import WorldSimSettings
from ..runtime.base_node import GraphNode
from ..runtime.command_matching import CommandMatching
from ..runtime.command_timeout import CommandTimeout
from ..runtime.polled_subscriptions import PolledSubscriptions, SerializedMessage
from ..runtime.refused_inputs import RefusedInputs
from .robot_namespace import NamespacedNode

REST: Point = (0.0, 0.0)


class CommandSubscriptions:
    """Lockstep: the command of the tick's stamp. Real time: the newest, until it times out."""

    def __init__(
        self,
        node: GraphNode | NamespacedNode,
        settings: WorldSimSettings,
        world: Callable[[], World],
        refused_inputs: RefusedInputs,
        on_cmd_vel: Callable[[], None],
    ) -> None:
        """Subscribe for the robot of a world; in lockstep call on_cmd_vel after each Twist."""
        self.command: Point = REST  # as World.step takes it
        self._settings = settings
        self._world = world
        self._refused_inputs = refused_inputs
        self._notify = on_cmd_vel
        self._command_matching = CommandMatching()
        self._command_timeout = CommandTimeout(settings)
        stamped = TwistStamped if settings.enable_stamped_cmd_vel else None
        node.subscribe(topics.CMD_VEL, self._on_cmd_vel, stamped)
        # Polled when a Twist was received: the executor need not wake up for it.
        self._goal_steps = PolledSubscriptions()
        step = topics.GOAL_STEP
        node.subscribe_polled(
            self._goal_steps, step.type, step.name, self._on_goal_step, [step.qos]
        )

    def take(self, stamp: int) -> bool:
        """Lockstep: follow the Twist of this stamp; False if it was not received or is taken."""
        if not self._settings.enable_stamped_cmd_vel:
            self._goal_steps.poll()
        message = self._command_matching.take(stamp)
        if message is not None:
            self._convert(message)
        return message is not None

    def stop(self) -> None:
        """Set the command to rest."""
        self.command = REST

    def stop_if_timed_out(self) -> None:
        """Real time: rest where the last Twist is too old."""
        if self._command_timeout.has_expired(time.monotonic()):
            self.stop()

    def _convert(self, message: Any) -> None:
        """Make a Twist the command; rest where it is refused."""
        self.stop()
        world = self._world()
        try:
            self.command = command_from_twist(message, world.scenario.robot, world.pose.yaw)
        except InputError as error:
            self._refused_inputs.add(error)

    def _on_cmd_vel(self, message: Any, info: Any) -> None:
        if not self._settings.lockstep:
            self._command_timeout.received(time.monotonic())
            self._convert(message)
            return
        sent_ns = info["source_timestamp"]
        if self._settings.enable_stamped_cmd_vel:
            self._command_matching.add_goal_step(stamp_ns(message.header.stamp), sent_ns)
        self._command_matching.add_cmd_vel(message, sent_ns)
        self._notify()

    def _on_goal_step(self, message: SerializedMessage) -> None:
        self._command_matching.add_goal_step(header_stamp_ns(message.data), message.sent_ns)
