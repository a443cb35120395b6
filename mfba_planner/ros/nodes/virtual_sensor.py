# SPDX-License-Identifier: Apache-2.0
"""virtual_sensor: turns obstacle poses, or any laser scan, into the sensory vector (eq. 11)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ...core.errors import InputError
from ...core.geometry import Point, Pose2D
from ...core.types import Ranges, Scan
from ...perception.scan_to_sectors import sense_scan
from ...perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from ...recording.from_messages import laser_scan, obstacle_centers, robot_pose, stamp_ns
from ..endpoints.sensor_diagnostics import SensorHealth
from ..interface import parameters, topics
from ..interface.to_messages import sectors_msg, sensory_vector_msg
from ..node_parameters import Source, VirtualSensorSettings, names
from ..runtime.node_runtime import GraphNode, Refusals, spin_node
from ..runtime.stamp_pairing import StampPairs

_DEFAULT_RADII = [0.3]


class VirtualSensor(GraphNode):
    """The ring of virtual sensors; a refused input becomes NaN sectors, never free ones."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.VIRTUAL_SENSOR, **kwargs)
        self.settings = s = parameters.declare(self, VirtualSensorSettings(), read_only=True)
        self.sensor = parameters.declare(self, SensorParams())
        self.radii = parameters.declare_radii(self, _DEFAULT_RADII)
        parameters.follow(self, lambda: self.sensor, self._set_sensor)
        self._refusals = Refusals(self)
        self._by_stamp = s.lockstep or s.source is Source.OBSTACLES
        self._start_afresh()
        self._sectors = self.advertise(topics.SECTORS)
        self._vector = self.advertise(topics.SENSORY_VECTOR)
        self.listen(topics.ODOM, self._on_odom, from_anyone=not s.lockstep)
        self._source = topics.OBSTACLES if s.source is Source.OBSTACLES else topics.SCAN
        self._health = SensorHealth(self, s, self._refusals, self._source.name)
        self.listen(self._source, self._on_measurement)
        self.advertise_ready(names(s.wait_for))
        self.on_time_set_back(self._start_afresh)

    def _set_sensor(self, sensor: SensorParams) -> None:
        self.sensor = sensor

    def _start_afresh(self) -> None:
        # A pair that comes again is answered again: a planner may have been restarted.
        self._pairs: StampPairs[Pose2D | None, Any] = StampPairs(again=True)
        self._pose: Pose2D | None = None

    def _on_odom(self, message: Any) -> None:
        self._pose, fault = None, ""
        self._health.heard("odom", stamp_ns(message.header.stamp))
        try:
            self._pose = robot_pose(message)
        except InputError as error:
            fault = self._refused(error, "odom")
        self._health.judged("odom", fault)
        if self._by_stamp:
            self._join(self._pairs.add_a, "odom", message, self._pose)

    def _on_measurement(self, message: Any) -> None:
        self._health.heard(self._source.name, stamp_ns(message.header.stamp))
        if self._by_stamp:
            self._join(self._pairs.add_b, self._source.name, message, message)
        else:
            self._answer(stamp_ns(message.header.stamp), self._pose, message)

    def _join(self, add: Any, name: str, message: Any, value: Any) -> None:
        stamp = stamp_ns(message.header.stamp)
        try:
            pair = add(stamp, value)
        except InputError as error:
            self._refused(error, name)
            return
        if pair is not None:
            self._answer(stamp, *pair)

    def _answer(self, stamp: int, pose: Pose2D | None, message: Any) -> None:
        """Publish sectors for one stamp; NaN where the inputs were refused."""
        s = self.settings
        ranges: Ranges = (math.nan,) * self.sensor.sectors
        fault = ""
        if pose is not None:
            try:
                ranges = self._measure(pose, message)
            except InputError as error:
                fault = self._refused(error, self._source.name)
        else:
            self.get_logger().warning(
                "no usable odom: the sectors are blind", throttle_duration_sec=1.0
            )
        self._sectors.publish(
            sectors_msg(ranges, self.sensor, s.robot_radius_m, stamp, s.odom_frame)
        )
        if not math.isnan(ranges[0]):
            self._vector.publish(sensory_vector_msg(sensory_vector(ranges)))
        self._health.judged(self._source.name, fault)

    def _refused(self, error: InputError, source: str) -> str:
        self._refusals.add(error, source)
        return str(error)

    def _measure(self, pose: Pose2D, message: Any) -> Ranges:
        s = self.settings
        if s.source is Source.SCAN:
            scan: Scan = laser_scan(message, s.scan_frame)
            return sense_scan(scan, pose.yaw + s.scan_yaw, s.robot_radius_m, self.sensor)
        centers = obstacle_centers(message)
        circles = zip(centers, self._enlarged(centers))
        return sense_circles(pose.position, circles, self.sensor)

    def _enlarged(self, centers: Sequence[Point]) -> list[float]:
        """One radius stands for all; otherwise there must be one per obstacle."""
        radii = self.radii * len(centers) if len(self.radii) == 1 else self.radii
        if len(radii) != len(centers):
            raise InputError(
                f"{len(centers)} obstacles but {len(radii)} obstacle_radii_m; give one each"
            )
        return [r + self.settings.robot_radius_m for r in radii]


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(VirtualSensor, args)
