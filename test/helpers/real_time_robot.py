# SPDX-License-Identifier: Apache-2.0
"""virtual_sensor and planner in real time, with odometry and scans sent by hand, for tests."""

import math
import time
from typing import Any

from planner_talk import fields, goal, mode
from rclpy.publisher import Publisher
from ros_graph import Graph
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import NANO, Mode
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import odometry_msg, time_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor

TIMEOUT_S = 5.0  # long, so that a busy machine does not look like a fault
TRACKING = {"method": "predictive"}  # a planner that reads scans itself
BEAMS = 90
FREE = (math.inf,) * BEAMS
WALL = (0.7,) * BEAMS  # on all sides


def scan_of(stamp_ns: int, ranges: Any = FREE, frame: str = "base_scan", **changes: Any) -> Any:
    """A scan of the whole circle."""
    width = 2.0 * math.pi / BEAMS
    values = {
        "angle_min": -math.pi,
        "angle_max": math.pi - width,
        "angle_increment": width,
        "range_min": 0.1,
        "range_max": 10.0,
    }
    header = Header(stamp=time_msg(stamp_ns), frame_id=frame)
    return LaserScan(header=header, ranges=ranges, **{**values, **changes})


class RealTimeRobot:
    """Two nodes with a goal 10 m ahead; stamps are the wall clock's plus an offset."""

    def __init__(self, graph: Graph, sensor: Any = (), planner: Any = (), **both: Any) -> None:
        self.graph = graph
        self.odom, self.scan = graph.writer(topics.ODOM), graph.writer(topics.SCAN)
        self.sectors = graph.collect(topics.SECTORS)
        self.decisions = graph.collect(topics.DECISION)
        self.diagnostics = graph.collect(topics.DIAGNOSTICS)
        self._goal = graph.writer(topics.GOAL_POSE)
        self._goal.publish(goal(10.0, 0.0))
        both = {"input_timeout_s": TIMEOUT_S, "diagnostics_period_s": 0.05, **both}
        self.sensor = graph.start(VirtualSensor, {"source": "scan", **both, **dict(sensor)})
        self.planner = graph.start(PlannerNode, {**both, **dict(planner)})
        graph.until(lambda: self.planner.goals.goal_queue.goal is not None)

    def send_odom(self, stamp_ns: int, writer: Publisher | None = None, x: float = 0.0) -> None:
        """Publish odometry and deliver it."""
        message = odometry_msg(Pose2D(x, 0.0), (0.0, 0.0), stamp_ns, "odom", "base_link")
        (writer or self.odom).publish(message)
        self.graph.settle()

    def send_scan(self, message: Any, writer: Publisher | None = None) -> str:
        """Publish a scan and deliver it; the mode of the decision on it, "" without one."""
        count = len(self.decisions)
        (writer or self.scan).publish(message)
        self.graph.settle()
        new = self.decisions[count:]
        return mode(new[-1]).value if new else ""

    def drive(self, odom_s: float = 0.0, scan_s: float = 0.0, ranges: Any = FREE) -> str:
        """Odometry and a scan, stamped now plus offsets in s; the mode of the decision."""
        self.send_odom(stamp(odom_s))
        return self.send_scan(scan_of(stamp(scan_s), ranges))

    @property
    def reason(self) -> str:
        """The reason of the last decision."""
        return fields(self.decisions[-1])["reason"]

    def inputs(self, node: str) -> Any:
        """A node's newest status "inputs"; all callbacks have run by then."""
        name, count = f"{node}: inputs", len(self.diagnostics)

        def found() -> list[Any]:
            statuses = [s for message in self.diagnostics[count:] for s in message.status]
            return [status for status in statuses if status.name == name]

        self.graph.until(lambda: bool(found()))
        return found()[-1]

    def value(self, node: str, key: str) -> str:
        """A value of a node's status "inputs"."""
        return {item.key: item.value for item in self.inputs(node).values}[key]


def stamp(offset_s: float = 0.0) -> int:
    """The wall clock's time plus an offset, in ns."""
    return time.time_ns() + round(offset_s / NANO)


DRIVES, STOPS = Mode.PATH_GENERATION.value, Mode.STOPPED.value
