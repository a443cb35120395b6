# SPDX-License-Identifier: Apache-2.0
"""What world_sim hears of the planner: every Twist, or the one that answers a stamp."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TwistStamped

from ..core.geometry import Point
from ..messages import stamp_ns
from ..node_settings import WorldSimSettings
from . import topics
from .answers import Answers
from .deadman import Deadman
from .letterboxes import Letter, Letterboxes
from .namespaced import Namespaced
from .runtime import GraphNode
from .serialized import header_stamp_ns


class AnswerTopics:
    """The subscriptions of world_sim to cmd_vel and goal_step."""

    def __init__(
        self,
        node: GraphNode | Namespaced,
        settings: WorldSimSettings,
        on_twist: Callable[[Any], None],
        on_heard: Callable[[], None],
    ) -> None:
        """Subscribe; on_twist takes every Twist, in lockstep on_heard says that one has come."""
        self._settings = settings
        self._on_twist = on_twist
        self._on_heard = on_heard
        self._answers = Answers()
        self._deadman = Deadman(settings)
        stamped = TwistStamped if settings.enable_stamped_cmd_vel else None
        node.listen(topics.CMD_VEL, self._on_cmd_vel, stamped)
        # Looked into when a Twist has come: nothing more to wake up for.
        self._goal_steps = Letterboxes()
        step = topics.GOAL_STEP
        node.open_boxes(self._goal_steps, step.type, step.name, self._on_goal_step, [step.qos])

    def take(self, stamp: int) -> Any:
        """The Twist that answers this stamp, once; None while there is none."""
        if not self._settings.enable_stamped_cmd_vel:
            self._goal_steps.empty()
        return self._answers.take(stamp)

    def still_holds(self, velocity: Point) -> Point:
        """Real time: the velocity that was commanded, or rest where that was too long ago."""
        return (0.0, 0.0) if self._deadman.lets_go(time.monotonic()) else velocity

    def _on_cmd_vel(self, message: Any, info: Any) -> None:
        if not self._settings.lockstep:
            self._deadman.heard(time.monotonic())
            self._on_twist(message)
            return
        sent_ns = info["source_timestamp"]
        if self._settings.enable_stamped_cmd_vel:
            self._answers.goal_step(stamp_ns(message.header.stamp), sent_ns)
        self._answers.cmd_vel(message, sent_ns)
        self._on_heard()

    def _on_goal_step(self, letter: Letter) -> None:
        self._answers.goal_step(header_stamp_ns(letter.data), letter.sent_ns)
