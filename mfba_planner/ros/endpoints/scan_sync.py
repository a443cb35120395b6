# SPDX-License-Identifier: Apache-2.0
"""The scan beside the sectors, for a planner that tracks what it shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...core.errors import InputError
from ...core.types import Observation, Scan
from ...perception.scan_to_sectors import aligned
from ...planning.planner_params import PlannerParams
from ...recording.from_messages import laser_scan, stamp_ns
from ..interface import topics
from ..runtime.node_runtime import GraphNode, Refusals
from ..runtime.stamp_pairing import StampPairs


class ScanSync:
    """Hands sectors on with the scan of their stamp; without tracking, at once and alone."""

    def __init__(
        self,
        node: GraphNode,
        refusals: Refusals,
        deliver: Callable[[Any], None],
        params: PlannerParams,
        scan_yaw_rad: float,
    ) -> None:
        """Whether scans are wanted at all, params say."""
        self._node, self._refusals, self._deliver = node, refusals, deliver
        self._yaw, self.tracks = scan_yaw_rad, params.tracks_scan
        self.forget()

    def listen(self) -> None:
        """Subscribe to sectors, and to scans where they are wanted."""
        on_sectors = self._on_sectors if self.tracks else self._deliver
        self._node.listen(topics.SECTORS, on_sectors)
        if self.tracks:
            self._node.listen(topics.SCAN, self._on_scan)

    def forget(self) -> None:
        """Begin anew, as when time was set back."""
        self._pairs: StampPairs[Any, Any] = StampPairs(again=True)
        self._scan: Scan | None = None

    def seen(self, obs: Observation) -> Observation:
        """The observation with the scan that its sectors were made of."""
        if self._scan is None or obs.refused:
            return obs
        return replace(obs, scan=aligned(self._scan, obs.pose.yaw + self._yaw))

    def _on_sectors(self, message: Any) -> None:
        self._join(self._pairs.add_a, message)

    def _on_scan(self, message: Any) -> None:
        self._join(self._pairs.add_b, message)

    def _join(self, add: Any, message: Any) -> None:
        try:
            pair = add(stamp_ns(message.header.stamp), message)
        except InputError as error:
            self._refusals.add(error, "scan")
            return
        if pair is not None:
            sectors, scan = pair
            self._scan = laser_scan(scan)
            self._deliver(sectors)
