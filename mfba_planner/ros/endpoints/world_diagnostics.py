# SPDX-License-Identifier: Apache-2.0
"""world_sim's /diagnostics: nodes that cannot exchange messages with it."""

from __future__ import annotations

import time
from collections.abc import Callable

from ..node_settings import WorldSimSettings
from ..runtime.base_node import GraphNode
from .diagnostics_publisher import DiagnosticsPublisher


class WorldDiagnostics(DiagnosticsPublisher):
    """Publishes the status "connections" once a period, and at once when it changes."""

    def __init__(
        self, node: GraphNode, settings: WorldSimSettings, stamp_ns: Callable[[], int]
    ) -> None:
        """Advertise /diagnostics; stamp_ns() is the present tick's stamp."""
        super().__init__(node, settings)
        self._tick_stamp_ns = stamp_ns

    def _check(self) -> None:
        super()._check()
        now_s = time.monotonic()
        self.set_time(self._tick_stamp_ns(), now_s)
        self.publish([], now_s, changed=False)
