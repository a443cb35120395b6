# SPDX-License-Identifier: Apache-2.0
"""Real nodes and a probe node on one executor, over real DDS, for tests."""

from collections.abc import Callable
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from waiting import spin_until

from mfba_planner.ros.interface.topics import Topic
from mfba_planner.ros.runtime.base_node import GraphNode
from mfba_planner.ros.runtime.spin_node import make_executor

N = TypeVar("N", bound=GraphNode)
SETTLE_SPINS = 40  # delivery within a process is synchronous: two spins deliver one message
LATCHED_TIMEOUT_S = 30.0  # but a reader that came later gets its first messages from a thread


class Graph:
    """A context with nodes under test, and a probe that publishes, subscribes and calls."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.executor = make_executor(context)
        self.probe = rclpy.create_node("probe", context=context)
        self.executor.add_node(self.probe)
        self.nodes: list[GraphNode] = []

    def start(self, node_type: type[N], /, parameters: dict[str, Any], **options: Any) -> N:
        """Construct a node with these parameters, have it told what is latched, and add it."""
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        node = node_type(context=self.context, parameter_overrides=overrides, **options)
        for publisher in self.probe.publishers:
            if publisher.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                assert publisher.wait_for_all_acked(Duration(seconds=LATCHED_TIMEOUT_S))
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def stop(self, node: GraphNode) -> None:
        """Close and destroy a node as its process would."""
        self.nodes.remove(node)
        self.executor.remove_node(node)
        node.close()
        node.destroy_node()

    def close(self) -> None:
        for node in list(self.nodes):
            self.stop(node)
        self.executor.shutdown()
        self.probe.destroy_node()

    def writer(
        self, topic: Topic, message_type: Any = None, qos: QoSProfile | None = None
    ) -> Publisher:
        """A publisher of the probe, matched at once as all nodes are in one process."""
        return self.probe.create_publisher(
            message_type or topic.type, topic.name, qos or topic.qos
        )

    def collect(
        self, topic: Topic, message_type: Any = None, qos: QoSProfile | None = None
    ) -> list[Any]:
        """A list that fills with the messages of a topic."""
        received: list[Any] = []
        self.probe.create_subscription(
            message_type or topic.type, topic.name, received.append, qos or topic.qos
        )
        return received

    def collect_times(self, *topics: Topic) -> list[tuple[int, str]]:
        """A list of (publication time, topic name) for the messages of several topics."""
        received: list[tuple[int, str]] = []

        def callback(name: str) -> Any:
            return lambda _, info: received.append((info["source_timestamp"], name))

        for topic in topics:
            self.probe.create_subscription(topic.type, topic.name, callback(topic.name), topic.qos)
        return received

    def until(self, condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
        """Spin all nodes until a condition holds."""
        spin_until(self.executor, condition, timeout_s)

    def settle(self) -> None:
        """Spin until all messages are delivered and their callbacks have run."""
        for _ in range(SETTLE_SPINS):
            self.executor.spin_once(timeout_sec=0.0)

    def call(self, service_type: Any, name: str, request: Any = None) -> Any:
        """Call a service and return its response."""
        client = self.probe.create_client(service_type, name)
        self.until(client.service_is_ready)
        future = client.call_async(request or service_type.Request())
        self.until(future.done)
        self.probe.destroy_client(client)
        return future.result()

    def parameters(self, node: str, names: list[str]) -> list[Any]:
        """Values of a node's parameters, from its service."""
        client = AsyncParameterClient(self.probe, node)
        self.until(client.services_are_ready)
        future = client.get_parameters(names)
        self.until(future.done)
        return [parameter_value_to_python(value) for value in future.result().values]

    def set_parameter(self, node: str, name: str, value: Any) -> str:
        """Set one parameter of a node through its service; the refusal's reason, or empty."""
        client = AsyncParameterClient(self.probe, node)
        self.until(client.services_are_ready)
        future = client.set_parameters([Parameter(name, value=value)])
        self.until(future.done)
        (result,) = future.result().results
        assert result.successful == (not result.reason)
        return str(result.reason)
