# SPDX-License-Identifier: Apache-2.0
"""The publisher of /diagnostics in planner, virtual_sensor and world_sim."""

from __future__ import annotations

import time
from typing import Any

from ...core.planner_types import NANO
from ..interface import to_messages, topics
from ..interface.connections import connections_status
from ..interface.diagnostic_status import Status
from ..node_settings import PlannerSettings, VirtualSensorSettings, WorldSimSettings
from ..runtime.base_node import GraphNode
from ..runtime.connection_check import PERIOD_S, ConnectionCheck


class DiagnosticsPublisher:
    """Publishes /diagnostics once a period, and at once when something changes.

    It adds the status "connections": types and QoS of the node's topics.
    Its stamps follow those of the node's inputs; in between, a steady clock is added.
    """

    def __init__(
        self,
        node: GraphNode,
        settings: PlannerSettings | VirtualSensorSettings | WorldSimSettings,
    ) -> None:
        """Advertise /diagnostics, and start to check the connections."""
        self._publisher = node.advertise(topics.DIAGNOSTICS)
        self._node_name = node.get_fully_qualified_name().lstrip("/")
        self._hardware_id = settings.hardware_id
        self._period_ns = round(settings.diagnostics_period_s / NANO)
        self._last_ns = -1
        self._last_summary: list[Any] = []
        self._stamp_ns, self._stamp_s = node.get_clock().now().nanoseconds, time.monotonic()
        self._connections = ConnectionCheck(node)
        node.create_wall_timer(PERIOD_S, self._check)

    def _check(self) -> None:
        self._connections.check()

    def set_time(self, stamp_ns: int, now_s: float) -> None:
        """An input has this stamp; with the same stamp again the time keeps running."""
        if stamp_ns != self._stamp_ns:
            self._stamp_ns, self._stamp_s = stamp_ns, now_s

    def is_due(self, now_s: float) -> bool:
        """Whether a period has passed since the last message, or time was set back."""
        stamp_ns = self._stamp(now_s)
        return not 0 <= self._last_ns <= stamp_ns < self._last_ns + self._period_ns

    def publish(self, statuses: list[Status], now_s: float, *, changed: bool) -> None:
        """Publish if a period has passed, a level has changed, or `changed` is True."""
        statuses = [*statuses, connections_status(self._connections.mismatches)]
        summary = [status.summary for status in statuses]
        if changed or summary != self._last_summary or self.is_due(now_s):
            self._last_summary, self._last_ns = summary, self._stamp(now_s)
            message = to_messages.diagnostics_msg(
                statuses, self._node_name, self._hardware_id, self._last_ns
            )
            self._publisher.publish(message)

    def _stamp(self, now_s: float) -> int:
        return self._stamp_ns + round((now_s - self._stamp_s) / NANO)
