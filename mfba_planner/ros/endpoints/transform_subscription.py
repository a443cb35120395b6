# SPDX-License-Identifier: Apache-2.0
"""The tree of frames from /tf and /tf_static, where tf2_msgs is installed."""

from __future__ import annotations

from collections.abc import Callable

from ...recording.transform_tree import TransformTree
from ..interface import topics
from ..runtime.base_node import GraphNode


class TransformSubscription:
    """Reads all transforms; a node without need of any subscribes to nothing."""

    def __init__(self, node: GraphNode) -> None:
        """Subscribe to nothing yet."""
        self._node, self._is_subscribed = node, False
        self.tree = TransformTree()
        self.on_new: Callable[[], None] = lambda: None  # called after each message

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
        for topic in topics.TRANSFORMS:
            self._node.subscribe(topic, self._take)

    def _take(self, message: object) -> None:
        self.tree.add(message)
        self.on_new()

    def unsubscribed(self) -> None:
        """The node has destroyed all subscriptions."""
        self._is_subscribed = False
