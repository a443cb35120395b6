# SPDX-License-Identifier: Apache-2.0
"""Measures sectors in the scans of virtual_sensor, with the extrinsics of their lidars."""

from __future__ import annotations

from typing import Any, NamedTuple

from ...core.geometry import Pose2D
from ...core.planner_types import Ranges
from ...perception.scan_to_sectors import sense_scan
from ...perception.sensory_vector import SensorParams
from ...recording.from_messages import laser_scan
from ...recording.scan_parts import LidarMerging
from ..node_settings import Source, VirtualSensorSettings
from ..runtime.base_node import GraphNode
from ..runtime.input_monitor import InputMonitor
from .scan_extrinsics import ScanExtrinsics
from .transform_subscription import TransformSubscription

KEPT_POSES = 100  # odometry of the last stamps, for several lidars in lockstep
_MOST_LIDARS = 4  # that may send at the same moment


class Measured(NamedTuple):
    """The ranges of all sectors, and the stamp of the newest scan that they are from."""

    stamp_ns: int
    ranges_m: Ranges


class ScanSensing:
    """Sector ranges from any LaserScans; warns of what their lidars do not see."""

    def __init__(
        self, node: GraphNode, settings: VirtualSensorSettings, monitor: InputMonitor
    ) -> None:
        """Subscribe to tf where scans are read and it is needed. Raises ConfigError."""
        self._settings, self._monitor = settings, monitor
        self.transforms = TransformSubscription(node)
        self.extrinsics = ScanExtrinsics(settings, self.transforms)
        if settings.source is Source.SCAN and self.extrinsics.reads_tf:
            self.transforms.subscribe()
        # Queue of scans in real time, where only the newest of each lidar counts.
        self.depth = _MOST_LIDARS if self.extrinsics.reads_tf else 1
        self._lidars = LidarMerging(
            self.extrinsics.of,
            self.extrinsics.name,
            lambda message: laser_scan(message, settings.scan_frame, settings.scan_no_return),
            lambda: settings.robot_radius_m,
            settings.scan_frame,
        )

    def reset(self) -> None:
        """Forget what was received, as when time was set back."""
        self._lidars.reset()

    def text(self, sensor: SensorParams) -> str:
        """What is measured, for the node's first line."""
        s = self._settings
        by = f"; {self.extrinsics.text}" if s.source is Source.SCAN else ""
        return (
            f"{sensor.sectors} sectors up to {sensor.sensing_range_m:g} m from {s.source.value}, "
            f"robot radius {s.robot_radius_m:g} m{by}"
        )

    def add_pose(self, stamp_ns: int, pose: Pose2D) -> None:
        """Take a pose of the robot, by which older scans are brought to the newest."""
        self._lidars.poses.add(stamp_ns, pose)

    def measure(
        self, stamp_ns: int, message: Any, pose: Pose2D, sensor: SensorParams
    ) -> Measured | None:
        """Take a scan; the ranges by it and by those of other lidars.

        None where another lidar's scan is about to come. Raises InputError where one is refused.
        """
        s, lidars = self._settings, self._lidars
        if not lidars.add(message, s.input_timeout_s):
            return None
        mounted = lidars.newest(s.input_timeout_s)
        self._monitor.scan_note = lidars.note
        newest_ns = lidars.sets.newest_ns
        if newest_ns != stamp_ns:  # the other one came first
            pose = lidars.poses.at(newest_ns) or pose
        ranges = sense_scan(mounted.scan, pose.yaw, s.robot_radius_m, sensor, mounted.extrinsics)
        return Measured(newest_ns, ranges)
