# SPDX-License-Identifier: Apache-2.0
"""A real graph in real time with a relay that may alter or drop the messages between nodes."""

from collections.abc import Callable
from typing import Any

from ros_graph import Graph

from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim

TICK_NS = 100_000_000
SPEED_FACTOR = 0.25  # slow motion: a busy machine must not look like a fault
TIMEOUT_S = 0.16  # of simulated time

Tamper = Callable[[Any], Any]  # returns the altered message; None: it is lost


class RelayedGraph:
    """world_sim, virtual_sensor and planner, whose odom, scan and sectors pass through a relay.

    The world has no lidar: the relay adds a scan per odom, with `beams` as its ranges.
    """

    def __init__(self, graph: Graph, scenario: str, **planner: Any) -> None:
        self.graph = graph
        self.tamper: dict[str, Tamper] = {}
        self.beams = [float("inf")] * 360
        self.odom = graph.collect(topics.ODOM)
        self.decisions = graph.collect(topics.DECISION)
        self._diagnostics = graph.collect(topics.DIAGNOSTICS)
        self.cmd_vel = graph.collect(topics.CMD_VEL)
        self._relayed = {
            topic.name: graph.probe.create_publisher(
                topic.type, f"tampered/{topic.name}", topic.qos
            )
            for topic in (topics.ODOM, topics.SCAN, topics.SECTORS)
        }
        for topic, deliver in ((topics.ODOM, self._on_odom), (topics.SECTORS, self._on_sectors)):
            graph.probe.create_subscription(topic.type, topic.name, deliver, topic.qos)
        self.sensor = graph.start(
            VirtualSensor,
            {
                "source": "scan",
                "scan_frame": "base_link",
                "input_timeout_s": TIMEOUT_S / SPEED_FACTOR,
                "use_sim_time": True,
            },
            cli_args=_remapped("odom", "scan"),
        )
        self.planner = graph.start(
            PlannerNode,
            {"step_length_m": 0.08, "speed_mps": 0.8, "input_timeout_s": TIMEOUT_S / SPEED_FACTOR}
            | {"use_sim_time": True}
            | planner,
            cli_args=_remapped("odom", "sectors"),
        )
        parameters = {"scenario": scenario, "tick_ns": TICK_NS, "speed_factor": SPEED_FACTOR}
        self.world = graph.start(WorldSim, parameters | {"cmd_vel_timeout_s": 0.2 / SPEED_FACTOR})

    def _on_odom(self, message: Any) -> None:
        self._relay("odom", message)
        scan = topics.SCAN.type()
        scan.header.stamp = message.header.stamp
        scan.header.frame_id = "base_link"
        scan.angle_min, scan.angle_increment = 0.0, 6.283185307179586 / len(self.beams)
        scan.range_min, scan.range_max, scan.ranges = 0.05, 10.0, self.beams
        self._relay("scan", scan)

    def _on_sectors(self, message: Any) -> None:
        self._relay("sectors", message)

    def _relay(self, name: str, message: Any) -> None:
        altered = self.tamper.get(name, lambda same: same)(message)
        if altered is not None:
            self._relayed[name].publish(altered)

    def is_moving(self) -> bool:
        """Whether the last two odometry messages differ in position."""
        return len(self.odom) > 1 and _position(self.odom[-1]) != _position(self.odom[-2])

    def drive(self) -> int:
        """Wait until the robot moves; return the stamp of the newest odometry."""
        self.graph.until(lambda: len(self.odom) > 3 and self.is_moving(), timeout_s=20.0)
        return stamp_ns(self.odom[-1].header.stamp)

    def rest_after(self, since_ns: int) -> float:
        """Wait until the robot rests for three ticks; seconds it moved after a stamp."""
        self.graph.until(lambda: self._rested(since_ns) is not None, timeout_s=20.0)
        return (self._rested(since_ns) or 0) * 1e-9

    def _rested(self, since_ns: int) -> int | None:
        after = [m for m in self.odom if stamp_ns(m.header.stamp) >= since_ns]
        for k in range(len(after) - 3):
            if len({_position(m) for m in after[k : k + 4]}) == 1:
                return stamp_ns(after[k].header.stamp) - since_ns
        return None

    def diagnostics(self, node: str = "planner") -> list[Any]:
        """The messages of a node on /diagnostics."""
        return [m for m in self._diagnostics if m.status[0].name.startswith(f"{node}: ")]

    def status(self, name: str, node: str = "planner") -> Any:
        """A node's newest status of this name."""
        newest = self.diagnostics(node)[-1].status
        return next(status for status in newest if status.name == f"{node}: {name}")


def _remapped(*names: str) -> list[str]:
    rules = [word for name in names for word in ("-r", f"{name}:=tampered/{name}")]
    return ["--ros-args", *rules]


def _position(odom: Any) -> tuple[float, float]:
    p = odom.pose.pose.position
    return (p.x, p.y)
