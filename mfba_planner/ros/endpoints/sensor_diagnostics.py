# SPDX-License-Identifier: Apache-2.0
"""What virtual_sensor reports of its inputs on /diagnostics: why the planner is blind."""

from __future__ import annotations

import time

from ..interface.health import Health
from ..node_parameters import VirtualSensorSettings
from ..runtime.node_runtime import GraphNode, Refusals
from ..runtime.stale_inputs import watch_period_s
from .diagnostics_publisher import DiagnosticTopic


class SensorHealth:
    """Listens to what the sensor hears; publishes once in a period and on changes."""

    def __init__(
        self, node: GraphNode, settings: VirtualSensorSettings, refusals: Refusals, source: str
    ) -> None:
        """Advertise /diagnostics; source is the topic measured from, beside odom."""
        self._topic = DiagnosticTopic(node, settings)
        self._refusals = refusals
        self._source = source
        self._health = Health(("odom", source))
        self._timeout_s = settings.input_timeout_s
        self._seen: tuple[str, ...] = ()
        node.every(watch_period_s(self._timeout_s, lockstep=settings.lockstep), self.report)

    def heard(self, name: str, stamp_ns: int) -> None:
        """An input came."""
        now_s = time.monotonic()
        self._health.heard(name, stamp_ns, now_s)
        if name == self._source:  # one of the two: their stamps need not be in step
            self._topic.at(stamp_ns, now_s)

    def judged(self, name: str, fault: str) -> None:
        """What is wrong with the newest of an input, "": it is sound; said at once if new."""
        self._health.judged(name, fault)
        if self._health.faults != self._seen:
            self._seen = self._health.faults
            self.report(news=True)

    def report(self, *, news: bool = False) -> None:
        """Publish, if it is time to, or if something has fallen silent."""
        now_s = time.monotonic()
        status = self._health.inputs(now_s, self._timeout_s, self._refusals.by_kind)
        self._topic.publish([status], now_s, news=news)
