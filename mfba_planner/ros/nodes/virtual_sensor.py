# SPDX-License-Identifier: Apache-2.0
"""virtual_sensor: turns obstacle poses, or any laser scan, into the sensory vector (eq. 11)."""

from __future__ import annotations

import math
from typing import Any

from ...core.errors import InputError
from ...core.geometry import Pose2D
from ...core.planner_types import Ranges
from ...perception.sensory_vector import SensorParams, sensory_vector
from ...recording.from_messages import robot_pose, stamp_ns
from ..endpoints.obstacle_sensing import ObstacleSensing
from ..endpoints.odometry_source import OdometrySource
from ..endpoints.scan_sensing import KEPT_POSES, ScanSensing
from ..endpoints.sensor_diagnostics import SensorDiagnostics
from ..interface import parameters, topics
from ..interface.tick_serializers import SectorsSerializer, SensoryVectorSerializer
from ..node_settings import Source, VirtualSensorSettings, names
from ..runtime.base_node import GraphNode
from ..runtime.input_monitor import NEWEST, PAIRED, InputMonitor, InputVerdict
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.spin_node import spin_node
from ..runtime.stamp_pairing import StampPairs


class VirtualSensor(GraphNode):
    """The ring of virtual sensors; a refused input becomes NaN sectors, never free ones.

    One tick: _on_odom, _on_source -> pair -> _on_inputs -> _measure -> _publish.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a parameter that cannot be accepted."""
        super().__init__(topics.VIRTUAL_SENSOR, **kwargs)
        self.settings = s = parameters.declare(self, VirtualSensorSettings(), read_only=True)
        self.sensor = parameters.declare(self, SensorParams())
        parameters.follow(self, lambda: self.sensor, self._set_sensor)
        self._refused_inputs = RefusedInputs(self)
        self._monitor = InputMonitor(self, s, self._refused_inputs, s.input_timeout_s, self._reset)
        self._scan_sensing = scans = ScanSensing(self, s, self._monitor)
        obstacles = ObstacleSensing(self, s)
        self._measure = scans.measure if s.source is Source.SCAN else obstacles.measure
        self._by_stamp = s.lockstep or s.source is Source.OBSTACLES
        self._reset()
        self._serialized_sectors = SectorsSerializer(s.odom_frame)
        self._serialized_vector = SensoryVectorSerializer()
        self._sectors = self.advertise(topics.SECTORS)
        self._vector = self.advertise(topics.SENSORY_VECTOR)
        self._source = topics.OBSTACLES if s.source is Source.OBSTACLES else topics.SCAN
        self._diagnostics = SensorDiagnostics(
            self, s, self._refused_inputs, self._monitor, self._source.name
        )
        depth = PAIRED if self._by_stamp else NEWEST
        odometry = OdometrySource(self, s, scans.transforms, self._monitor, self._on_odom)
        odometry.subscribe(depth)
        depth, known = max(depth, scans.depth), scans.extrinsics.is_known
        self._monitor.subscribe(
            self._source, self._on_source, depth=depth, frame=s.scan_frame, is_merged=known
        )
        self.announce(scans.text(self.sensor) + odometry.text)
        self.advertise_ready(names(s.wait_for))

    def _set_sensor(self, sensor: SensorParams) -> None:
        self.sensor = sensor

    def _reset(self) -> None:
        # A repeated pair is measured again: a planner may have been restarted.
        kept = KEPT_POSES if self.settings.source is Source.SCAN else 0
        self._pairs: StampPairs[Pose2D | None, Any] = StampPairs(repeat=True, kept=kept)
        self._pose: Pose2D | None = None  # None: no odom yet, or the newest was refused
        self._monitor.reset()
        self._scan_sensing.reset()

    def _on_odom(self, message: Any) -> None:
        stamp, (fault, is_ordered) = stamp_ns(message.header.stamp), self._check("odom", message)
        self._scan_sensing.extrinsics.robot_is(message.child_frame_id)
        try:
            self._pose = None if fault else robot_pose(message)
        except InputError as error:
            self._pose, fault = None, self._refuse(error, "odom")
        if self._pose is not None:
            self._scan_sensing.add_pose(stamp, self._pose)
        self._diagnostics.set_fault("odom", fault)
        if self._by_stamp and is_ordered:
            self._pair("odom", stamp, self._pose, self._pairs.add_a)

    def _on_source(self, message: Any) -> None:
        """Obstacles or scan: converted in _measure, where a refusal becomes NaN sectors."""
        stamp, name = stamp_ns(message.header.stamp), self._source.name
        fault, is_ordered = self._check(name, message)
        if not is_ordered:
            self._diagnostics.set_fault(name, fault)
        elif self._by_stamp:
            self._pair(name, stamp, fault or message, self._pairs.add_b)
        else:
            self._on_inputs(stamp, self._pose, fault or message)

    def _check(self, name: str, message: Any) -> InputVerdict:
        verdict = self._monitor.check(name, message)
        if verdict.is_ordered:
            self._diagnostics.input_received(name, stamp_ns(message.header.stamp))
        return verdict

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
        fault = message if isinstance(message, str) else ""
        if pose is None:
            self.get_logger().warning(
                "no usable odom: the sectors are blind", throttle_duration_sec=1.0
            )
        elif not fault:
            try:
                measured = self._measure(stamp, message, pose, self.sensor)
            except InputError as error:
                fault = self._refuse(error, self._source.name)
            else:
                if measured is None:  # another lidar's scan is about to come
                    return
                stamp, ranges = measured
        self._publish(stamp, ranges)
        self._diagnostics.set_fault(self._source.name, fault)

    def _publish(self, stamp: int, ranges: Ranges) -> None:
        radius_m = self.settings.robot_radius_m
        self._sectors.publish(self._serialized_sectors(ranges, self.sensor, radius_m, stamp))
        if not math.isnan(ranges[0]):
            self._vector.publish(self._serialized_vector(sensory_vector(ranges)))

    def _refuse(self, error: InputError, source: str) -> str:
        self._refused_inputs.add(error, source)
        return str(error)


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(VirtualSensor, args)
