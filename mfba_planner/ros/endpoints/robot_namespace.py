# SPDX-License-Identifier: Apache-2.0
"""The graph's topics in the namespace of one robot of a fleet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from ..interface.topics import GRAPH, Topic
from ..runtime.base_node import GraphNode
from ..runtime.polled_subscriptions import Deliver, PolledSubscriptions


def below(namespace: str, topic: Topic) -> Topic:
    """The topic in a namespace; absolute names are kept."""
    if not namespace or topic.name.startswith("/"):
        return topic
    return replace(topic, name=f"{namespace}/{topic.name}")


def graph_topics(namespaces: set[str]) -> Iterator[tuple[Topic, str]]:
    """Every topic of the graph with its name, then those of the namespaces."""
    for namespace in ("", *sorted(namespaces)):
        for topic in GRAPH:
            name = below(namespace, topic).name
            if not namespace or name != topic.name:
                yield topic, name


class NamespacedNode:
    """A node that publishes and subscribes in a namespace other than its own."""

    def __init__(self, node: GraphNode, namespace: str) -> None:
        """Nothing is created yet."""
        self._node, self._namespace = node, namespace

    def advertise(self, topic: Topic, message_type: Any = None) -> Publisher:
        """As GraphNode.advertise()."""
        return self._node.advertise(below(self._namespace, topic), message_type)

    def subscribe(
        self, topic: Topic, callback: Callable[..., None], message_type: Any = None
    ) -> None:
        """As GraphNode.subscribe()."""
        self._node.subscribe(below(self._namespace, topic), callback, message_type)

    def subscribe_polled(
        self,
        polled: PolledSubscriptions,
        message_type: Any,
        name: str,
        deliver: Deliver,
        profiles: list[QoSProfile],
    ) -> None:
        """As GraphNode.subscribe_polled()."""
        name = f"{self._namespace}/{name}"
        self._node.subscribe_polled(polled, message_type, name, deliver, profiles)
