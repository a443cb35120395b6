# SPDX-License-Identifier: Apache-2.0
"""The planner's odom, sectors and scan: converted, then paired into the inputs of one decision."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from ...core.errors import InputError
from ...core.planner_types import Observation, Scan
from ...perception.scan_to_sectors import aligned
from ...planning.planner_params import PlannerParams
from ...recording.from_messages import laser_scan, robot_pose, sector_ranges, stamp_ns
from ..interface import topics
from ..node_settings import PlannerSettings
from ..runtime.input_monitor import PAIRED, InputMonitor
from ..runtime.lockstep_inputs import Inputs, LockstepInputs
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.stale_inputs import NewestInputs
from ..runtime.stamp_pairing import StampPairs
from .planner_diagnostics import PlannerDiagnostics


class InputSubscriptions:
    """Calls on_inputs for each pair of odom and sectors; a refused message is its error text.

    Where the planner tracks obstacles, sectors wait for the scan of their stamp.
    """

    def __init__(
        self,
        settings: PlannerSettings,
        params: PlannerParams,
        refused_inputs: RefusedInputs,
        monitor: InputMonitor,
        diagnostics: PlannerDiagnostics,
        on_inputs: Callable[[Inputs], None],
    ) -> None:
        """params.tracks_scan is read once: whether scan is subscribed to."""
        self._settings, self._monitor = settings, monitor
        self._tracks_scan = params.tracks_scan
        self._refused_inputs, self._diagnostics = refused_inputs, diagnostics
        self._on_inputs = on_inputs
        self.range_max_m = 0.0  # of the newest sectors
        self.reset()

    def reset(self) -> None:
        """Forget what was received, as when time was set back."""
        lockstep = self._settings.lockstep
        self._pairs: LockstepInputs | NewestInputs = (
            LockstepInputs() if lockstep else NewestInputs()
        )
        limit = None if lockstep else PAIRED
        self._scan_pairs: StampPairs[Any, Any] = StampPairs(repeat=True, limit=limit)
        self._monitor.reset()

    def subscribe(self) -> None:
        """Subscribe to odom and sectors, and to scan where it is needed."""
        frame = self._settings.odom_frame
        self._monitor.subscribe(topics.ODOM, self._on_odom, frame=frame)
        self._monitor.subscribe(topics.SECTORS, self._on_sectors, frame=frame)
        if self._tracks_scan:
            frame = self._settings.scan_frame
            self._monitor.subscribe(topics.SCAN, self._on_scan, depth=PAIRED, frame=frame)

    def stale(self, timeout_s: float) -> Inputs | None:
        """In real time the newest inputs if one is older than timeout_s."""
        self._monitor.timeout_s = timeout_s
        return self._pairs.stale(time.monotonic(), timeout_s)

    def add_scan(self, observation: Observation, scan: Scan | None) -> Observation:
        """Return the observation with the scan that its sectors were computed from."""
        if scan is None or observation.refused:
            return observation
        yaw = observation.pose.yaw + self._settings.scan_yaw
        return replace(observation, scan=aligned(scan, yaw))

    def _on_odom(self, message: Any) -> None:
        fault = self._check("odom", message)
        if fault is not None:
            self._receive("odom", message, robot_pose, self._pairs.add_odom, fault)

    def _on_sectors(self, message: Any) -> None:
        fault = self._check("sectors", message)
        if fault is None:
            return
        if self._tracks_scan:
            self._pair_scan(message, fault, self._scan_pairs.add_a)
        else:
            self._receive_sectors(message, fault)

    def _on_scan(self, message: Any) -> None:
        fault = self._check("scan", message)
        if fault is not None:
            self._diagnostics.set_fault("scan", fault)
            self._pair_scan(message, fault, self._scan_pairs.add_b)

    def _check(self, name: str, message: Any) -> str | None:
        """Why a message is refused, "" if it is not; None: it must not even be paired."""
        verdict = self._monitor.check(name, message)
        if verdict.is_ordered:
            return verdict.fault
        self._refuse(name, verdict.fault)
        return None

    def _refuse(self, name: str, fault: str) -> None:
        self._pairs.refuse(name, fault)
        self._diagnostics.set_fault(name, fault)

    def _pair_scan(self, message: Any, fault: str, add: Any) -> None:
        try:
            pair = add(stamp_ns(message.header.stamp), (message, fault))
        except InputError as error:
            self._refused_inputs.add(error, "scan")
            return
        if pair is not None:
            (sectors, fault), (scan, scan_fault) = pair
            converted, conversion_fault = self._convert(
                "scan", scan, laser_scan, self._settings.scan_frame
            )
            fault = fault or scan_fault or conversion_fault
            self._receive_sectors(sectors, fault, None if fault else converted)

    def _receive_sectors(self, message: Any, fault: str, scan: Scan | None = None) -> None:
        self.range_max_m = message.range_max
        add = partial(self._pairs.add_sectors, scan=scan)
        self._receive("sectors", message, sector_ranges, add, fault)

    def _receive(self, name: str, message: Any, convert: Any, add: Any, fault: str) -> None:
        """Convert one message and pair it; a complete pair goes to on_inputs."""
        stamp, now_s = stamp_ns(message.header.stamp), time.monotonic()
        value: Any = fault  # refused already
        if not fault:
            value, fault = self._convert(name, message, convert, self._settings.odom_frame)
        try:
            inputs = add(stamp, value, now_s)
        except InputError as error:
            self._refused_inputs.add(error, name)
            if fault:  # late, and older than one that was not
                self._refuse(name, fault)
            return
        self._diagnostics.input_received(name, stamp, now_s, fault)
        if inputs is not None:
            self._on_inputs(inputs)

    def _convert(self, name: str, message: Any, convert: Any, frame: str) -> tuple[Any, str]:
        """The value and "", or the error text twice: as the value and as the fault."""
        try:
            return convert(message, frame), ""
        except InputError as error:
            self._refused_inputs.add(error, name)
            return str(error), str(error)
