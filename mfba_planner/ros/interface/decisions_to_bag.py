# SPDX-License-Identifier: Apache-2.0
"""Writes decisions made on a recording as the bag that the nodes on that robot would have made."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message

from ...core.planner_types import Decision
from ...perception.sensory_vector import SensorParams, sensory_vector
from ...perception.static_map import StaticMap
from ...planning.planner_params import PlannerParams
from ...recording.bag_reader import BagReader
from ...recording.bag_writer import BagWriter
from ...recording.configuration_attachment import attach_configuration
from . import to_messages, topics
from .qos_conversion import offered
from .serialized_message import type_name

_TOPICS = (
    topics.ODOM, topics.SCAN, topics.SECTORS, topics.SENSORY_VECTOR, topics.GOAL_POSE,
    topics.GOAL_STEP, topics.PLAN, topics.CMD_VEL, topics.DECISION, topics.LOCAL_MAP,
)  # fmt: skip
_MAP_PERIOD_NS = 1_000_000_000


class DecisionBag:
    """A bag in writing; an incomplete one is deleted by discard()."""

    def __init__(
        self, directory: Path, planner: PlannerParams, sensor: SensorParams, frame: str
    ) -> None:
        """Create the directory. Raises OutputError where nothing can be written."""
        self._planner, self._sensor, self._frame = planner, sensor, frame
        self._goal_id, self._map_ns, self._map_version = 0, -_MAP_PERIOD_NS, (-1, -1)
        self._writer = BagWriter(directory)
        for topic in _TOPICS:
            self._writer.add_topic(_name(topic), type_name(topic.type), offered(topic.qos))

    def copy(self, reader: BagReader, scans: Sequence[str], odom: str) -> None:
        """Copy the messages of some topics, as `scan` and `odom`; odom may be ""."""
        names = dict.fromkeys(scans, _name(topics.SCAN))
        if odom:
            names[odom] = _name(topics.ODOM)
        for message in reader.messages(names):
            self._writer.write(
                names[message.topic], message.data, message.log_time_ns, message.publish_time_ns
            )

    def add(
        self,
        decision: Decision,
        log_time_ns: int,
        goal_id: int,
        local_map: StaticMap | None,
        fields: Mapping[str, str],
    ) -> None:
        """Write the messages of sensor and planner of one decision; fields are keys more."""
        stamp, planner = decision.stamp_ns, self._planner
        if goal_id != self._goal_id and decision.goal is not None:
            goal = to_messages.pose_stamped_msg(decision.goal, stamp, self._frame)
            self._write(topics.GOAL_POSE, goal, log_time_ns)
        self._goal_id = goal_id
        ranges = decision.ranges_m or (math.nan,) * self._sensor.sectors
        sectors = to_messages.sectors_msg(
            ranges, self._sensor, planner.robot_radius_m, stamp, self._frame
        )
        self._write(topics.SECTORS, sectors, log_time_ns)
        if decision.ranges_m:
            vector = to_messages.sensory_vector_msg(sensory_vector(ranges))
            self._write(topics.SENSORY_VECTOR, vector, log_time_ns)
        step = to_messages.pose_stamped_msg(decision.waypoint, stamp, self._frame)
        self._write(topics.GOAL_STEP, step, log_time_ns)
        twist = to_messages.twist_msg(decision, planner, planner.tick_ns)
        self._write(topics.CMD_VEL, twist, log_time_ns)
        self._write(topics.PLAN, to_messages.plan_msg(decision, self._frame), log_time_ns)
        fields = {"goal_id": str(goal_id), **fields}
        message = to_messages.decision_msg(
            decision, planner.label, 0, f"/{topics.PLANNER}", fields
        )
        self._write(topics.DECISION, message, log_time_ns)
        self._write_map(local_map, stamp, log_time_ns)

    def close(self, nodes: Mapping[str, Any], facts: Mapping[str, Any]) -> None:
        """Attach the parameters of the nodes and the facts of the run; finish the bag."""
        attach_configuration(self._writer, {"nodes": nodes, "run": facts})
        self._writer.close()

    def discard(self) -> None:
        """Delete what was written."""
        self._writer.discard()

    def _write_map(self, local_map: StaticMap | None, stamp_ns: int, log_time_ns: int) -> None:
        if local_map is None or not local_map.count:
            return
        version = (id(local_map), local_map.version)
        if version == self._map_version or stamp_ns - self._map_ns < _MAP_PERIOD_NS:
            return
        grid = local_map.known_grid()
        if grid is not None:
            self._map_ns, self._map_version = stamp_ns, version
            message = to_messages.occupancy_grid_msg(grid, self._frame)
            self._write(topics.LOCAL_MAP, message, log_time_ns)

    def _write(self, topic: topics.Topic, message: Any, log_time_ns: int) -> None:
        self._writer.write(_name(topic), serialize_message(message), log_time_ns, log_time_ns)


def _name(topic: topics.Topic) -> str:
    return f"/{topic.name}"
