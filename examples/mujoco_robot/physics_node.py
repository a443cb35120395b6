# SPDX-License-Identifier: Apache-2.0
"""The robot as a ROS node: it publishes scan, odom, /tf and /tf_static and follows cmd_vel.

In real time it follows the clock. Else time stands from a scan until the cmd_vel (TwistStamped) of
its stamp has come: as fast as planner and machine are, and with the same decisions every time. As
nodes keep the newest odometry only, it is then published just before each scan.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import rclpy
from crowded_room import PEOPLE, Walk, draw_room
from film import save_frames
from geometry_msgs.msg import TransformStamped, TwistStamped
from physics_world import ODOMETRY_NS, SCAN_NS, Lifted, PhysicsWorld
from planner_in_process import (
    FILM_PERIOD_NS,
    REACTION_NS,
    SCAN_AGE_NS,
    robot_rng,
    stamp_at,
)
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from robot_model_xml import LIDAR_Z_M

from mfba_planner.core.geometry import distance, towards
from mfba_planner.core.planner_types import Scan
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface.markers import tf_msg
from mfba_planner.ros.interface.to_messages import odometry_msg, scan_msg
from mfba_planner.ros.interface.topics import CMD_VEL, ODOM, SCAN, TRANSFORMS
from mfba_planner.ros.runtime.base_node import readers_not_reached
from mfba_planner.ros.runtime.spin_node import StopFlag, make_executor

ODOM_FRAME, BASE_FRAME, SCAN_FRAME = "odom", "base_link", "base_scan"
BEGIN_AFTER_S = 0.5  # not in real time: for the first odometry, which would else be replaced


def lidar_on_base() -> TransformStamped:
    """Where the lidar is on the base, for /tf_static."""
    transform = TransformStamped(child_frame_id=SCAN_FRAME)
    transform.header.frame_id = BASE_FRAME
    transform.transform.translation.z = LIDAR_Z_M
    return transform


class PhysicsNode(Node):
    """Publishes what the robot measures; the world moves on in _on_timer or _on_cmd_vel."""

    def __init__(self, **kwargs: Any) -> None:
        """Wait for the nodes of wait_for; each has to subscribe to scan and odom."""
        super().__init__("robot", **kwargs)
        values = {
            "world": 0,
            "people": PEOPLE,
            "walk": Walk.WAYPOINTS.value,
            "kidnapped": False,
            "lifted": Lifted.JUMPS.value,
            "real_time": False,
            "wait_for": "",
            "result": "",
            "film": "",
        }
        found = {name: self.declare_parameter(name, value).value for name, value in values.items()}
        room = draw_room(
            found["world"],
            people=found["people"],
            walk=Walk(found["walk"]),
            kidnapped=found["kidnapped"],
        )
        self.physics = PhysicsWorld(
            room, robot_rng(found["world"]), lifted=Lifted(found["lifted"])
        )
        self._result, self._film = found["result"], found["film"]
        self._real_time = found["real_time"]
        self._wait_for = {name for name in found["wait_for"].split(",") if name}
        self._film_ns = FILM_PERIOD_NS if self._film else 0
        qos = QoSProfile(depth=50)
        self._odom = self.create_publisher(ODOM.type, ODOM.name, qos)
        self._scan = self.create_publisher(SCAN.type, SCAN.name, qos)
        self._tf = None
        if TRANSFORMS:
            moving, static = TRANSFORMS
            self._tf = self.create_publisher(moving.type, moving.name, qos)
            self._static = self.create_publisher(static.type, static.name, static.qos)
            self._static.publish(static.type(transforms=[lidar_on_base()]))
        else:
            self.get_logger().info("tf2_msgs is not installed: no /tf, no /tf_static")
        self.create_subscription(TwistStamped, CMD_VEL.name, self._on_cmd_vel, qos)
        self._scans: list[tuple[int, Scan]] = []  # measured, not yet published
        self._started_ns: int | None = None  # the stamp of time 0
        self._begin_at = 0.0
        self._awaited_ns = 0  # the stamp whose command moves time on; 0: none
        self.create_timer(0.005, self._on_timer)

    def _has_readers(self) -> bool:
        for publisher in (self._odom, self._scan):
            if readers_not_reached(self, publisher, self._wait_for):
                return False
        return self.count_publishers(CMD_VEL.name) > 0 or not self._wait_for

    def _on_timer(self) -> None:
        if self._started_ns is None:
            if not self._has_readers():
                return
            now_ns = self.get_clock().now().nanoseconds
            self._started_ns = now_ns if self._real_time else stamp_at(0)
            self._publish_odometry()
            self._measure()
            self._begin_at = time.monotonic() + BEGIN_AFTER_S
        elif self._begin_at and not self._real_time and time.monotonic() > self._begin_at:
            self._begin_at = 0.0
            self._until_next_scan_arrives()
        if self._real_time:
            self._advance(self.get_clock().now().nanoseconds - self._started_ns)

    def _advance(self, until_ns: int) -> None:
        """Step to a time, or just before it, and publish what is measured and due on the way."""
        physics = self.physics
        while physics.now_ns + ODOMETRY_NS <= until_ns:
            physics.advance(physics.now_ns + ODOMETRY_NS, self._film_ns)
            is_due = bool(self._scans) and self._scans[0][0] + SCAN_AGE_NS <= physics.now_ns
            if self._real_time or is_due:
                self._publish_odometry()
            self._measure()
            if is_due:
                at_ns, scan = self._scans.pop(0)
                self._awaited_ns = self._stamp(at_ns)
                self._scan.publish(scan_msg(scan, self._awaited_ns, SCAN_FRAME))

    def _until_next_scan_arrives(self) -> None:
        self._advance(self._scans[0][0] + SCAN_AGE_NS)

    def _stamp(self, at_ns: int) -> int:
        return (self._started_ns or 0) + at_ns

    def _measure(self) -> None:
        if self.physics.now_ns % SCAN_NS == 0:
            self._scans.append((self.physics.now_ns, self.physics.scan()))

    def _publish_odometry(self) -> None:
        odometry, at_ns = self.physics.odometry, self._stamp(self.physics.now_ns)
        velocity = towards((0.0, 0.0), odometry.pose.yaw, odometry.speed_mps)
        message = odometry_msg(
            odometry.pose, velocity, at_ns, ODOM_FRAME, BASE_FRAME, odometry.turn_radps
        )
        if self._tf:
            self._tf.publish(tf_msg(message))
        self._odom.publish(message)

    def _on_cmd_vel(self, message: TwistStamped) -> None:
        physics, twist = self.physics, message.twist
        if self._real_time:
            physics.command(twist.linear.x, twist.angular.z)
            return
        if stamp_ns(message.header.stamp) != self._awaited_ns or not self._awaited_ns:
            return  # another one on the same scan
        tick_ns, self._awaited_ns = self._awaited_ns - self._stamp(0), 0
        self._advance(tick_ns + REACTION_NS)
        physics.command(twist.linear.x, twist.angular.z)
        self._advance(tick_ns + SCAN_NS)
        self._until_next_scan_arrives()

    def close(self) -> None:
        """Write what the engine has counted, and the frames of the film."""
        physics = self.physics
        if self._result:
            off = distance(physics.pose.position, physics.odometry.pose.position)
            content = {
                "time_s": physics.time_s,
                "contacts": [asdict(event) for event in physics.contacts],
                "pose": list(physics.pose),
                "off_goal_m": distance(physics.pose.position, physics.scenario.goal_m),
                "odometry_off_m": off,
            }
            Path(self._result).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        if self._film:
            save_frames(Path(self._film), physics.frames)


def main(args: list[str]) -> int:
    """Run the node until a signal."""
    stop = StopFlag()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = PhysicsNode()
    executor = make_executor()
    executor.add_node(node)
    try:
        while not stop.is_set:
            executor.spin_once(timeout_sec=0.1)
    finally:
        node.close()
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
