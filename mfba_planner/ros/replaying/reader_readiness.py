# SPDX-License-Identifier: Apache-2.0
"""What must be there before the first message is played."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from std_srvs.srv import Trigger


class Readiness:
    """Subscribers on our topics, and nodes of the graph that are ready for their own part."""

    def __init__(
        self,
        node: Node,
        publishers: Mapping[str, Publisher],
        subscribers: Mapping[str, int] | None,
        nodes: tuple[str, ...],
    ) -> None:
        """Take the subscribers wanted per topic ({}: one on any, None: wait for nothing)."""
        self._publishers = publishers
        self._wanted = subscribers
        self._nodes = {} if subscribers is None else {name: _Ready(node, name) for name in nodes}

    @property
    def nobody(self) -> bool:
        """Whether nothing is waited for."""
        return self._wanted is None

    def missing(self) -> str:
        """What is missing, empty when nothing is."""
        if self._wanted is None:
            return ""
        found = {topic: p.get_subscription_count() for topic, p in self._publishers.items()}
        absent = [topic for topic, count in self._wanted.items() if found[topic] < count]
        if not self._wanted and not any(found.values()):
            absent = list(found)
        if absent:
            return f"too few subscribers on {', '.join(absent)}"
        reasons = ((name, ready.missing()) for name, ready in self._nodes.items())
        return next((f"{name} is not ready ({reason})" for name, reason in reasons if reason), "")


class _Ready:
    """Asks a node's ~/ready until it says yes."""

    def __init__(self, node: Node, name: str) -> None:
        self._client = node.create_client(Trigger, f"{name}/ready")
        self._future: Any = None

    def missing(self) -> str:
        if self._future is None:
            if not self._client.service_is_ready():
                return "it does not run"
            self._future = self._client.call_async(Trigger.Request())
        if not self._future.done():
            return "it does not answer"
        response = self._future.result()
        if not response.success:
            self._future = None
        return str(response.message)
