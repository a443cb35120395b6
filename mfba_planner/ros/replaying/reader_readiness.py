# SPDX-License-Identifier: Apache-2.0
"""The subscribers and nodes that replay waits for before the first message."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from std_srvs.srv import Trigger


class Readiness:
    """Whether the played topics have subscribers, and whether nodes of the graph are ready."""

    def __init__(
        self,
        node: Node,
        publishers: Mapping[str, Publisher],
        subscribers: Mapping[str, int] | None,
        nodes: tuple[str, ...],
    ) -> None:
        """subscribers: how many each topic needs; {}: any topic one, None: wait for nothing."""
        self._publishers = publishers
        self._required = subscribers
        self._nodes = (
            {} if subscribers is None else {name: _ReadyCall(node, name) for name in nodes}
        )

    @property
    def waits_for_nothing(self) -> bool:
        """Whether no subscriber and no node is required."""
        return self._required is None

    def missing(self) -> str:
        """What is missing, empty when nothing is."""
        if self._required is None:
            return ""
        found = {topic: p.get_subscription_count() for topic, p in self._publishers.items()}
        absent = [topic for topic, count in self._required.items() if found[topic] < count]
        if not self._required and not any(found.values()):
            absent = list(found)
        if absent:
            return f"too few subscribers on {', '.join(absent)}"
        reasons = ((name, client.missing()) for name, client in self._nodes.items())
        return next((f"{name} is not ready ({reason})" for name, reason in reasons if reason), "")


class _ReadyCall:
    """Calls a node's ~/ready until it succeeds."""

    def __init__(self, node: Node, name: str) -> None:
        self._client = node.create_client(Trigger, f"{name}/ready")
        self._future: Any = None

    def missing(self) -> str:
        if self._future is None:
            if not self._client.service_is_ready():
                return "it does not run"
            self._future = self._client.call_async(Trigger.Request())
        if not self._future.done():
            return "it does not respond"
        response = self._future.result()
        if not response.success:
            self._future = None
        return "" if response.success else str(response.message)
