# SPDX-License-Identifier: Apache-2.0
"""How every node lives and dies: init, spin, and a clean end on SIGINT and SIGTERM."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from . import topics
from .topics import Topic, expected_readers

SPIN_S = 0.1  # longest time until a signal is noticed


class StopFlag:
    """Set by SIGINT and SIGTERM; nothing is raised, so no write is ever torn apart."""

    def __init__(self) -> None:
        """Take over both signals (main thread only)."""
        self.is_set = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, *_: object) -> None:
        self.is_set = True


def make_executor(context: rclpy.Context | None = None) -> Executor:
    """The executor all nodes use; MultiThreadedExecutor is far slower and drops messages."""
    return SingleThreadedExecutor(context=context)


def spin_node(make_node: Callable[[], GraphNode], args: list[str]) -> int:
    """Run one node until it is told to stop; return 0. MfbaErrors of the node pass through."""
    stop = StopFlag()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node: GraphNode | None = None
    try:
        node = make_node()
        executor = make_executor()
        executor.add_node(node)
        while not stop.is_set and not node.finished:
            executor.spin_once(timeout_sec=SPIN_S)
        return 0
    finally:
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()


class GraphNode(Node):
    """A node of the graph: publishers made from topics.py, and the service ~/ready."""

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Pass rclpy's keyword arguments on (context, parameter_overrides, ...)."""
        super().__init__(name, **kwargs)
        self.finished = False
        self._writers: list[tuple[Topic, Publisher]] = []
        self._peers: set[str] = set()

    def advertise(self, topic: Topic, message_type: Any = None) -> Publisher:
        """Create the publisher of a topic of topics.py.

        Without rclpy's QoS events: each is one more thing to wait for at every turn of the
        executor, and a reader with the wrong QoS is warned on its own side.
        """
        publisher = self.create_publisher(
            message_type or topic.type,
            topic.name,
            topic.qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        self._writers.append((topic, publisher))
        return publisher

    def listen(self, topic: Topic, callback: Callable[[Any], None], kind: Any = None) -> None:
        """Create the subscription of a topic of topics.py; two of them for a latched one."""
        for qos in topics.reading_qos(topic):
            self.create_subscription(kind or topic.type, topic.name, callback, qos)

    def offer_ready(self, peers: set[str]) -> None:
        """Offer ~/ready: true once every peer's subscription to our topics is matched."""
        self._peers = peers
        self.create_service(Trigger, "~/ready", self._on_ready)

    def missing(self) -> str:
        """What is still missing before a first message would reach everybody; empty: nothing."""
        for topic, publisher in self._writers:
            expected = expected_readers(topic, self._peers - {self.get_name()})
            found = publisher.get_subscription_count()
            if found < expected:
                return f"{topic.name} has {found} of {expected} subscribers"
        return ""

    def _on_ready(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self.missing()
        response.success = not response.message
        return response

    def close(self) -> None:
        """Release what must not be lost; called once, before the node is destroyed."""


class Refusals:
    """Counts the inputs a node refused, and says so once a second at most."""

    def __init__(self, node: Node) -> None:
        """Start at 0."""
        self.count = 0
        self._node = node

    def add(self, error: Exception) -> None:
        """Count one refused input."""
        self.count += 1
        self._node.get_logger().warning(
            f"refused ({self.count} so far): {error}", throttle_duration_sec=1.0
        )
