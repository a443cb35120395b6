# SPDX-License-Identifier: Apache-2.0
"""virtual_sensor: turns obstacle poses, or any laser scan, into the sensory vector (eq. 11)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ...core.errors import InputError
from ...core.geometry import Point, Pose2D
from ...core.planner_types import Ranges
from ...perception.scan_to_sectors import sense_scan
from ...perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from ...recording.from_messages import laser_scan, obstacle_centers, robot_pose, stamp_ns
from ..endpoints.sensor_diagnostics import SensorDiagnostics
from ..interface import parameters, topics
from ..interface.to_messages import sectors_msg, sensory_vector_msg
from ..node_settings import Source, VirtualSensorSettings, names
from ..runtime.base_node import GraphNode
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.spin_node import spin_node
from ..runtime.stamp_pairing import StampPairs

_DEFAULT_RADII = [0.3]


class VirtualSensor(GraphNode):
    """The ring of virtual sensors; a refused input becomes NaN sectors, never free ones.

    One tick: _on_odom, _on_source -> pair -> _on_inputs -> _perceive -> _publish.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.VIRTUAL_SENSOR, **kwargs)
        self.settings = s = parameters.declare(self, VirtualSensorSettings(), read_only=True)
        self.sensor = parameters.declare(self, SensorParams())
        self.radii = parameters.declare_radii(self, _DEFAULT_RADII)
        parameters.follow(self, lambda: self.sensor, self._set_sensor)
        self._refused_inputs = RefusedInputs(self)
        self._by_stamp = s.lockstep or s.source is Source.OBSTACLES
        self._reset()
        self._sectors = self.advertise(topics.SECTORS)
        self._vector = self.advertise(topics.SENSORY_VECTOR)
        self.subscribe(topics.ODOM, self._on_odom, foreign_writers=not s.lockstep)
        self._source = topics.OBSTACLES if s.source is Source.OBSTACLES else topics.SCAN
        self._diagnostics = SensorDiagnostics(self, s, self._refused_inputs, self._source.name)
        self.subscribe(self._source, self._on_source)
        self.advertise_ready(names(s.wait_for))
        self.on_time_set_back(self._reset)

    def _set_sensor(self, sensor: SensorParams) -> None:
        self.sensor = sensor

    def _reset(self) -> None:
        # A repeated pair is measured again: a planner may have been restarted.
        self._pairs: StampPairs[Pose2D | None, Any] = StampPairs(repeat=True)
        self._pose: Pose2D | None = None  # None: no odom yet, or the newest was refused

    def _on_odom(self, message: Any) -> None:
        stamp, fault = stamp_ns(message.header.stamp), ""
        self._diagnostics.input_received("odom", stamp)
        try:
            self._pose = robot_pose(message)
        except InputError as error:
            self._pose, fault = None, self._refuse(error, "odom")
        self._diagnostics.set_fault("odom", fault)
        if self._by_stamp:
            self._pair("odom", stamp, self._pose, self._pairs.add_a)

    def _on_source(self, message: Any) -> None:
        """Obstacles or scan: converted in _perceive, where a refusal becomes NaN sectors."""
        stamp = stamp_ns(message.header.stamp)
        self._diagnostics.input_received(self._source.name, stamp)
        if self._by_stamp:
            self._pair(self._source.name, stamp, message, self._pairs.add_b)
        else:
            self._on_inputs(stamp, self._pose, message)

    def _pair(self, name: str, stamp: int, value: Any, add: Any) -> None:
        try:
            pair = add(stamp, value)
        except InputError as error:
            self._refuse(error, name)
            return
        if pair is not None:
            self._on_inputs(stamp, *pair)

    def _on_inputs(self, stamp: int, pose: Pose2D | None, message: Any) -> None:
        """One tick: the sectors of one stamp, NaN where an input was refused."""
        ranges: Ranges = (math.nan,) * self.sensor.sectors
        fault = ""
        if pose is None:
            self.get_logger().warning(
                "no usable odom: the sectors are blind", throttle_duration_sec=1.0
            )
        else:
            try:
                ranges = self._perceive(pose, message)
            except InputError as error:
                fault = self._refuse(error, self._source.name)
        self._publish(stamp, ranges)
        self._diagnostics.set_fault(self._source.name, fault)

    def _perceive(self, pose: Pose2D, message: Any) -> Ranges:
        """Convert obstacles or scan and measure; InputError where it is refused."""
        s = self.settings
        if s.source is Source.SCAN:
            scan = laser_scan(message, s.scan_frame)
            return sense_scan(scan, pose.yaw + s.scan_yaw, s.robot_radius_m, self.sensor)
        centers = obstacle_centers(message)
        circles = zip(centers, self._enlarged_radii(centers))
        return sense_circles(pose.position, circles, self.sensor)

    def _enlarged_radii(self, centers: Sequence[Point]) -> list[float]:
        """A single radius holds for all obstacles; otherwise one per obstacle is required."""
        radii = self.radii * len(centers) if len(self.radii) == 1 else self.radii
        if len(radii) != len(centers):
            raise InputError(
                f"{len(centers)} obstacles but {len(radii)} obstacle_radii_m; give one each"
            )
        return [r + self.settings.robot_radius_m for r in radii]

    def _publish(self, stamp: int, ranges: Ranges) -> None:
        s = self.settings
        self._sectors.publish(
            sectors_msg(ranges, self.sensor, s.robot_radius_m, stamp, s.odom_frame)
        )
        if not math.isnan(ranges[0]):
            self._vector.publish(sensory_vector_msg(sensory_vector(ranges)))

    def _refuse(self, error: InputError, source: str) -> str:
        self._refused_inputs.add(error, source)
        return str(error)


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(VirtualSensor, args)
