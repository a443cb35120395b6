# SPDX-License-Identifier: Apache-2.0
"""The graph's topics as one robot of a fleet has them: below its name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from ..interface.topics import GRAPH, Topic
from ..runtime.node_runtime import GraphNode
from ..runtime.polled_subscriptions import Deliver, PolledSubscriptions


def below(namespace: str, topic: Topic) -> Topic:
    """The topic in a namespace; absolute names stay what they are."""
    if not namespace or topic.name.startswith("/"):
        return topic
    return replace(topic, name=f"{namespace}/{topic.name}")


def everywhere(namespaces: set[str]) -> Iterator[tuple[Topic, str]]:
    """Every topic of the graph and what it is called, then those of the namespaces."""
    for namespace in ("", *sorted(namespaces)):
        for topic in GRAPH:
            called = below(namespace, topic).name
            if not namespace or called != topic.name:
                yield topic, called


class NamespacedNode:
    """A node that speaks and listens in a namespace other than its own."""

    def __init__(self, node: GraphNode, namespace: str) -> None:
        """Nothing is created yet."""
        self._node, self._namespace = node, namespace

    def advertise(self, topic: Topic, message_type: Any = None) -> Publisher:
        """As GraphNode.advertise()."""
        return self._node.advertise(below(self._namespace, topic), message_type)

    def listen(self, topic: Topic, callback: Callable[..., None], kind: Any = None) -> None:
        """As GraphNode.listen()."""
        self._node.listen(below(self._namespace, topic), callback, kind)

    def subscribe_polled(
        self,
        polled: PolledSubscriptions,
        kind: Any,
        name: str,
        deliver: Deliver,
        profiles: list[QoSProfile],
    ) -> None:
        """As GraphNode.open_boxes()."""
        self._node.subscribe_polled(polled, kind, f"{self._namespace}/{name}", deliver, profiles)
