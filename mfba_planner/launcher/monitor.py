# SPDX-License-Identifier: Apache-2.0
"""The launcher's own ears and voice in the graph: who is ready, how far is it, is it over."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_srvs.srv import SetBool, Trigger

from ..messages import points, stamp_ns
from ..ros import topics

ASK_AGAIN_S = 0.5  # an answer can get lost while client and server still find each other
PROGRESS_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a run is, by the planner's newest decision."""

    stamp_ns: int
    mode: str
    distance_m: float


class Question:
    """A service call that is asked until it is answered; never waited for."""

    def __init__(self, client: Client, request: Any) -> None:
        """Ask nothing yet."""
        self._client = client
        self._request = request
        self._future: Any = None
        self._asked_at = 0.0

    def answer(self) -> Any:
        """The newest answer, once; None while there is none."""
        now = time.monotonic()
        if self._future is not None and self._future.done():
            answer, self._future = self._future.result(), None
            return answer
        if self._future is not None and now - self._asked_at > ASK_AGAIN_S:
            self._client.remove_pending_request(self._future)
            self._future = None
        if self._future is None and self._client.service_is_ready():
            self._future, self._asked_at = self._client.call_async(self._request), now
        return None


class Monitor:
    """A node beside the graph, which the graph does not wait for."""

    def __init__(self, domain_id: int) -> None:
        """Join the domain."""
        self._context = Context()
        self._context.init(domain_id=domain_id)
        self._node = Node(
            "launcher",
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._pause = self._node.create_client(SetBool, f"{topics.WORLD_SIM}/pause")
        self._decision: DiagnosticArray | None = None
        self._outcome: DiagnosticStatus | None = None

    def __enter__(self) -> Monitor:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    def spin(self, timeout_s: float) -> None:
        """Take in one thing that happens within timeout_s."""
        self._executor.spin_once(timeout_sec=timeout_s)

    def take_in(self) -> None:
        """Take in the newest of everything, now: the run must not be waited upon."""
        for _ in range(4):  # two topics and their late neighbours
            self._executor.spin_once(timeout_sec=0.0)

    def ask_ready(self, nodes: Iterable[str]) -> dict[str, Question]:
        """A question to ~/ready of each node."""
        return {
            name: Question(self._node.create_client(Trigger, f"{name}/ready"), Trigger.Request())
            for name in nodes
        }

    def ask_pause(self, paused: bool) -> Question:
        """The order to world_sim to stand still or to go on."""
        return Question(self._pause, SetBool.Request(data=paused))

    def listen(self) -> None:
        """Begin to hear the run: only now, or readiness would count these subscriptions."""
        node, decision, outcome = self._node, topics.DECISION, topics.OUTCOME
        node.create_subscription(decision.type, decision.name, self._on_decision, PROGRESS_QOS)
        node.create_subscription(outcome.type, outcome.name, self._on_outcome, outcome.qos)

    def _on_decision(self, message: DiagnosticArray) -> None:
        self._decision = message

    def _on_outcome(self, message: DiagnosticStatus) -> None:
        self._outcome = message

    def ticks_at_end(self) -> int | None:
        """How many ticks the run had; None while it runs."""
        if self._outcome is None or self._outcome.message == "running":
            return None
        return int(self._outcome.values[0].value)

    def progress(self) -> Progress | None:
        """How far the run is; None before the first decision."""
        if self._decision is None:
            return None
        fields = {item.key: item.value for item in self._decision.status[0].values}
        x, y, _ = map(float, fields["pose"].split(","))
        goal = points(fields["goal"])
        return Progress(
            stamp_ns=stamp_ns(self._decision.header.stamp),
            mode=fields["mode"],
            distance_m=math.dist((x, y), goal[0]) if goal else math.nan,
        )
