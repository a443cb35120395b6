# SPDX-License-Identifier: Apache-2.0
"""Real nodes and a probe on one executor, over real DDS, for tests that talk to nodes."""

from collections.abc import Callable
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from waiting import spin_until

from mfba_planner.ros.interface.topics import Topic
from mfba_planner.ros.runtime.graph_node import GraphNode
from mfba_planner.ros.runtime.spin_node import make_executor

N = TypeVar("N", bound=GraphNode)
SETTLE_TURNS = 40  # delivery within a process is synchronous: two turns bring one message


class Graph:
    """A context with nodes of ours, and one that publishes, listens and calls."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.executor = make_executor(context)
        self.probe = rclpy.create_node("probe", context=context)
        self.executor.add_node(self.probe)
        self.nodes: list[GraphNode] = []

    def start(self, kind: type[N], /, parameters: dict[str, Any], **options: Any) -> N:
        """Make a node with these parameters and spin it from now on."""
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        node = kind(context=self.context, parameter_overrides=overrides, **options)
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def stop(self, node: GraphNode) -> None:
        """End a node as its process would."""
        self.nodes.remove(node)
        self.executor.remove_node(node)
        node.close()
        node.destroy_node()

    def close(self) -> None:
        for node in list(self.nodes):
            self.stop(node)
        self.executor.shutdown()
        self.probe.destroy_node()

    def writer(self, topic: Topic, kind: Any = None, qos: QoSProfile | None = None) -> Publisher:
        """A publisher of the probe's, matched with its readers as all is in one process."""
        return self.probe.create_publisher(kind or topic.type, topic.name, qos or topic.qos)

    def hear(self, topic: Topic, kind: Any = None, qos: QoSProfile | None = None) -> list[Any]:
        """A list that fills with the messages of a topic."""
        heard: list[Any] = []
        self.probe.create_subscription(
            kind or topic.type, topic.name, heard.append, qos or topic.qos
        )
        return heard

    def hear_when(self, *topics: Topic) -> list[tuple[int, str]]:
        """A list of (time it was published, name) for the messages of several topics."""
        heard: list[tuple[int, str]] = []

        def note(name: str) -> Any:
            return lambda _, info: heard.append((info["source_timestamp"], name))

        for topic in topics:
            self.probe.create_subscription(topic.type, topic.name, note(topic.name), topic.qos)
        return heard

    def until(self, condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
        """Spin everything until a fact holds."""
        spin_until(self.executor, condition, timeout_s)

    def settle(self) -> None:
        """Let everything that is under way arrive and be answered."""
        for _ in range(SETTLE_TURNS):
            self.executor.spin_once(timeout_sec=0.0)

    def call(self, kind: Any, name: str, request: Any = None) -> Any:
        """Call a service and return its response."""
        client = self.probe.create_client(kind, name)
        self.until(client.service_is_ready)
        future = client.call_async(request or kind.Request())
        self.until(future.done)
        self.probe.destroy_client(client)
        return future.result()

    def parameters(self, node: str, names: list[str]) -> list[Any]:
        """Values of a node's parameters, asked of its service."""
        client = AsyncParameterClient(self.probe, node)
        self.until(client.services_are_ready)
        future = client.get_parameters(names)
        self.until(future.done)
        return [parameter_value_to_python(value) for value in future.result().values]

    def set_parameter(self, node: str, name: str, value: Any) -> str:
        """Set one parameter of a node over its service; why it was refused, or empty."""
        client = AsyncParameterClient(self.probe, node)
        self.until(client.services_are_ready)
        future = client.set_parameters([Parameter(name, value=value)])
        self.until(future.done)
        (result,) = future.result().results
        assert result.successful == (not result.reason)
        return str(result.reason)
