# SPDX-License-Identifier: Apache-2.0
"""Measures sectors in the scans of virtual_sensor, with the extrinsics of their lidar."""

from __future__ import annotations

from typing import Any

from ...core.planner_types import Ranges
from ...perception.near_returns import blind_ring
from ...perception.scan_to_sectors import aligned, sense_scan
from ...perception.sensory_vector import SensorParams
from ...recording.from_messages import laser_scan
from ..node_settings import Source, VirtualSensorSettings
from ..runtime.base_node import GraphNode
from ..runtime.input_monitor import InputMonitor
from .scan_extrinsics import ScanExtrinsics
from .transform_subscription import TransformSubscription


class ScanSensing:
    """Sector ranges from any LaserScan; warns of what its lidar does not see."""

    def __init__(
        self, node: GraphNode, settings: VirtualSensorSettings, monitor: InputMonitor
    ) -> None:
        """Subscribe to tf where scans are read and it is needed. Raises ConfigError."""
        self._settings, self._monitor = settings, monitor
        transforms = TransformSubscription(node)
        self.extrinsics = ScanExtrinsics(settings, transforms)
        if settings.source is Source.SCAN and self.extrinsics.reads_tf:
            transforms.subscribe()

    def text(self, sensor: SensorParams) -> str:
        """What is measured, for the node's first line."""
        s = self._settings
        by = f"; {self.extrinsics.text}" if s.source is Source.SCAN else ""
        return (
            f"{sensor.sectors} sectors up to {sensor.sensing_range_m:g} m from {s.source.value}, "
            f"robot radius {s.robot_radius_m:g} m{by}"
        )

    def measure(self, message: Any, yaw_rad: float, sensor: SensorParams) -> Ranges:
        """The ranges by a scan of a robot with this yaw; InputError where it is refused."""
        s = self._settings
        scan = laser_scan(message, s.scan_frame, s.scan_no_return)
        extrinsics = self.extrinsics.of(message.header.frame_id)
        self._monitor.scan_note = blind_ring(aligned(scan, 0.0, extrinsics), s.robot_radius_m)
        return sense_scan(scan, yaw_rad, s.robot_radius_m, sensor, extrinsics)
