# SPDX-License-Identifier: Apache-2.0
"""virtual_sensor's /diagnostics: the state of its inputs, and why its sectors are blind."""

from __future__ import annotations

import time

from ..interface.diagnostic_status import InputHealth
from ..node_settings import VirtualSensorSettings
from ..runtime.base_node import GraphNode
from ..runtime.input_monitor import InputMonitor
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.stale_inputs import watch_period_s
from .diagnostics_publisher import DiagnosticsPublisher


class SensorDiagnostics:
    """Records the sensor's inputs; publishes once a period and when something changes."""

    def __init__(
        self,
        node: GraphNode,
        settings: VirtualSensorSettings,
        refused_inputs: RefusedInputs,
        monitor: InputMonitor,
        source: str,
    ) -> None:
        """Advertise /diagnostics; source is the topic measured from, beside odom."""
        self._publisher = DiagnosticsPublisher(node, settings)
        self._refused_inputs, self._monitor = refused_inputs, monitor
        self._source = source
        self._health = InputHealth(("odom", source))
        self._timeout_s = settings.input_timeout_s
        self._published: tuple[str, ...] = ()
        period_s = watch_period_s(self._timeout_s, lockstep=settings.lockstep)
        node.create_wall_timer(period_s, self.publish)

    def input_received(self, name: str, stamp_ns: int) -> None:
        """An input was received."""
        now_s = time.monotonic()
        self._health.received(name, stamp_ns, now_s)
        if name == self._source:  # only one of the two: their stamps may differ
            self._publisher.set_time(stamp_ns, now_s)

    def set_fault(self, name: str, fault: str) -> None:
        """Why the newest of an input is refused, "" if it is not; published at once if new."""
        self._health.set_fault(name, fault)
        kinds = self._health.kinds_of_fault
        if kinds != self._published:
            self._published = kinds
            self.publish(changed=True)

    def publish(self, *, changed: bool = False) -> None:
        """Publish if a period has passed, or if something has changed."""
        now_s, monitor = time.monotonic(), self._monitor
        status = self._health.status(
            now_s, self._timeout_s, self._refused_inputs.by_kind, monitor.note, monitor.values
        )
        self._publisher.publish([status], now_s, changed=changed)
