# SPDX-License-Identifier: Apache-2.0
"""The launcher's ROS node: asks for readiness, pauses the world, follows the progress."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_srvs.srv import SetBool, Trigger

from ..recording.fleet_topics import NO_NAMESPACE
from ..recording.from_messages import parse_points, stamp_ns
from ..ros.endpoints.robot_namespace import below
from ..ros.interface import topics
from ..ros.interface.serialized_message import header_stamp_ns
from ..ros.interface.topics import Topic
from ..ros.runtime.base_node import GraphNode
from ..ros.runtime.polled_subscriptions import PolledSubscriptions

RESEND_S = 0.5  # a response can get lost during discovery
ASK_AGAIN_S = 0.005  # per node that is asked, or they have no time to get ready
PROGRESS_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """The progress of a run, from the planner's newest decision."""

    stamp_ns: int
    mode: str
    distance_m: float


class ServiceCall:
    """A service call that is sent again until a response comes; it never blocks."""

    def __init__(self, client: Client, request: Any, again_s: float = 0.0) -> None:
        """Send nothing yet, and later at most every again_s."""
        self._again_s = again_s
        self._client = client
        self._request = request
        self._future: Any = None
        self._sent_at = 0.0

    def response(self) -> Any:
        """Return the response, once; None while there is none."""
        now = time.monotonic()
        if self._future is not None and self._future.done():
            response, self._future = self._future.result(), None
            return response
        if self._future is not None and now - self._sent_at > RESEND_S:
            self._client.remove_pending_request(self._future)
            self._future = None
        due = now - self._sent_at >= self._again_s
        if self._future is None and due and self._client.service_is_ready():
            self._future, self._sent_at = self._client.call_async(self._request), now
        return None


class GraphMonitor:
    """A ROS node that watches the run; no other node waits for it."""

    def __init__(self, domain_id: int, robots: Sequence[str] = (NO_NAMESPACE,)) -> None:
        """Join the domain; robots are the namespaces to watch."""
        self._context = Context()
        self._context.init(domain_id=domain_id)
        self._node = GraphNode(
            "launcher",
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._pause = self._node.create_client(SetBool, f"{topics.WORLD_SIM}/pause")
        self._robots = robots
        self._polled = PolledSubscriptions()  # no wake-up for every message of the run
        self._decisions: dict[str, bytes] = {}
        self._ticks: dict[str, int] = {}

    def __enter__(self) -> GraphMonitor:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    def spin(self, timeout_s: float) -> None:
        """Handle one service response within timeout_s, and the newest message of each topic."""
        self._executor.spin_once(timeout_sec=timeout_s)
        self.poll()

    def poll(self) -> None:
        """Take the newest message of each topic, without waiting."""
        self._polled.poll()

    def call_ready(self, nodes: Collection[str]) -> dict[str, ServiceCall]:
        """A call of ~/ready for each node."""
        again_s = ASK_AGAIN_S * len(nodes)
        return {
            name: ServiceCall(
                self._node.create_client(Trigger, f"{name}/ready"), Trigger.Request(), again_s
            )
            for name in nodes
        }

    def call_pause(self, paused: bool) -> ServiceCall:
        """A call of world_sim/pause, to pause or to resume."""
        return ServiceCall(self._pause, SetBool.Request(data=paused))

    def subscribe(self) -> None:
        """Subscribe to the run; only when all are ready, or readiness would wait for this node."""
        for robot in self._robots:
            self._subscribe(robot, topics.DECISION, PROGRESS_QOS, self._on_decision)
            self._subscribe(robot, topics.OUTCOME, topics.OUTCOME.qos, self._on_outcome)

    def _subscribe(
        self, robot: str, topic: Topic, qos: QoSProfile, handle: Callable[[str, bytes], None]
    ) -> None:
        self._node.subscribe_polled(
            self._polled,
            topic.type,
            below(robot, topic).name,
            lambda message: handle(robot, message.data),
            [qos],
        )

    def _on_decision(self, robot: str, data: bytes) -> None:
        self._decisions[robot] = data

    def _on_outcome(self, robot: str, data: bytes) -> None:
        status = deserialize_message(data, topics.OUTCOME.type)
        if status.message != "running":
            self._ticks[robot] = int(status.values[0].value)

    def ticks_at_end(self) -> dict[str, int] | None:
        """Each robot's number of ticks; None while a robot still drives."""
        return self._ticks if len(self._ticks) == len(self._robots) else None

    def stamps_ns(self) -> dict[str, int]:
        """The stamp of each robot's last decision, ns."""
        return {robot: header_stamp_ns(data) for robot, data in self._decisions.items()}

    def progress(self) -> Progress | None:
        """The progress of the robot farthest from its goal; None before the first decision."""
        return max(
            map(_progress, self._decisions.values()), key=lambda p: p.distance_m, default=None
        )


def _progress(decision: bytes) -> Progress:
    message = deserialize_message(decision, topics.DECISION.type)
    fields = {item.key: item.value for item in message.status[0].values}
    x, y, _ = map(float, fields["pose"].split(","))
    goal = parse_points(fields["goal"])
    return Progress(
        stamp_ns=stamp_ns(message.header.stamp),
        mode=fields["mode"],
        distance_m=math.dist((x, y), goal[0]) if goal else math.nan,
    )
