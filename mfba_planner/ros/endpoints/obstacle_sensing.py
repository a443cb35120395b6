# SPDX-License-Identifier: Apache-2.0
"""Measures sectors among the obstacles of virtual_sensor, as in the paper."""

from __future__ import annotations

from typing import Any

from ...core.geometry import Pose2D
from ...core.segments import Segments
from ...perception.sense_segments import sense_circles_and_segments
from ...perception.sensory_vector import SensorParams, enlarged_radii
from ...recording.from_messages import obstacle_centers
from ...scenarios.scenario_json import parse_segments
from ..interface import parameters
from ..node_settings import VirtualSensorSettings
from ..runtime.base_node import GraphNode
from .scan_sensing import Measured


class ObstacleSensing:
    """Sector ranges from obstacle poses; their radii and the walls are parameters."""

    def __init__(self, node: GraphNode, settings: VirtualSensorSettings) -> None:
        """Declare the radii. Raises ConfigError."""
        self._robot_radius_m = settings.robot_radius_m
        self._radii = parameters.declare_radii(node, [0.3])
        self._segments = Segments.of(parse_segments(settings.segments_m))

    def measure(self, stamp_ns: int, message: Any, pose: Pose2D, sensor: SensorParams) -> Measured:
        """The ranges around a pose. Raises InputError where the message is refused."""
        centers = obstacle_centers(message)
        circles = zip(centers, enlarged_radii(len(centers), self._radii, self._robot_radius_m))
        ranges = sense_circles_and_segments(
            pose.position, circles, self._segments, self._robot_radius_m, sensor
        )
        return Measured(stamp_ns, ranges)
