# SPDX-License-Identifier: Apache-2.0
"""The tree of frames from /tf and /tf_static, where tf2_msgs is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...recording.transform_tree import TransformTree
from ..interface import topics
from ..runtime.base_node import GraphNode

DISCOVERY_S = 2.0  # until all publishers are known


class TransformSubscription:
    """Reads all transforms; a node without need of any subscribes to nothing."""

    def __init__(self, node: GraphNode) -> None:
        """Subscribe to nothing yet."""
        self._node, self._is_subscribed = node, False
        self.tree = TransformTree()
        self.on_new: Callable[[], None] = lambda: None  # called after each message
        self.on_moving: Callable[[Any], None] = lambda _: None  # called with each of /tf

    @property
    def is_published(self) -> bool:
        """Whether there are transforms on the graph, of whatever frames."""
        names = (self._node.resolve_topic_name(topic.name) for topic in topics.TRANSFORMS)
        return any(map(self._node.count_publishers, names))

    def subscribe(self) -> None:
        """Subscribe, once."""
        if self._is_subscribed:
            return
        self._is_subscribed = True
        for topic, take in zip(topics.TRANSFORMS, (self._take_moving, self._take)):
            self._node.subscribe(topic, take)

    def _take(self, message: Any) -> None:
        self.tree.add(message)
        self.on_new()

    def _take_moving(self, message: Any) -> None:
        self._take(message)
        self.on_moving(message)

    def unsubscribed(self) -> None:
        """The node has destroyed all subscriptions."""
        self._is_subscribed = False
