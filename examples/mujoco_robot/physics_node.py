# SPDX-License-Identifier: Apache-2.0
"""The robot as a ROS node: it publishes scan, odom and /tf and follows cmd_vel, nothing else.

Its parameters, topics and stamps tell no node that it is simulated. In real time stamps are those
of the clock. In lockstep time stands until the cmd_vel (TwistStamped) of a scan's stamp has come.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import rclpy
from crowded_room import draw_room
from film import save_frames
from geometry_msgs.msg import TwistStamped
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

from mfba_planner.core.geometry import distance, towards
from mfba_planner.core.planner_types import Scan
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface.markers import tf_msg
from mfba_planner.ros.interface.to_messages import odometry_msg, scan_msg
from mfba_planner.ros.interface.topics import CMD_VEL, ODOM, SCAN, TF
from mfba_planner.ros.runtime.spin_node import StopFlag, make_executor

ODOM_FRAME, BASE_FRAME, SCAN_FRAME = "odom", "base_link", "base_scan"
REPEAT_S = 2.0  # lockstep: publish a tick again, if no command has come


class PhysicsNode(Node):
    """Publishes what the robot measures; the world moves on in _on_timer or _on_cmd_vel."""

    def __init__(self, **kwargs: Any) -> None:
        """Wait for the nodes of wait_for; each has to subscribe to scan and odom."""
        super().__init__("robot", **kwargs)
        values = {
            "world": 0,
            "people": 10,
            "kidnapped": False,
            "lifted": Lifted.JUMPS.value,
            "lockstep": False,
            "wait_for": "",
            "result": "",
            "film": "",
        }
        found = {name: self.declare_parameter(name, value).value for name, value in values.items()}
        room = draw_room(
            found["world"], people=found["people"], kidnapped=found["kidnapped"]
        )
        self.physics = PhysicsWorld(
            room, robot_rng(found["world"]), lifted=Lifted(found["lifted"])
        )
        self._result, self._film = found["result"], found["film"]
        self._lockstep = found["lockstep"]
        self._wait_for = {name for name in found["wait_for"].split(",") if name}
        self._film_ns = FILM_PERIOD_NS if self._film else 0
        qos = QoSProfile(depth=50)
        self._odom = self.create_publisher(ODOM.type, ODOM.name, qos)
        self._scan = self.create_publisher(SCAN.type, SCAN.name, qos)
        self._tf = self.create_publisher(TF.type, TF.name, qos) if TF else None
        if not TF:
            self.get_logger().info("tf2_msgs is not installed: no /tf")
        self.create_subscription(TwistStamped, CMD_VEL.name, self._on_cmd_vel, qos)
        self._scans: list[tuple[int, Scan]] = []  # measured, not yet published
        self._started_ns = 0  # real time: the clock's time at the begin, else 1
        self._published_at = 0.0
        self.create_timer(0.005, self._on_timer)

    def _has_readers(self) -> bool:
        for publisher in (self._odom, self._scan):
            infos = self.get_subscriptions_info_by_topic(publisher.topic_name)
            readers = [info for info in infos if info.node_name in self._wait_for]
            if self._wait_for - {info.node_name for info in readers}:
                return False
            if publisher.get_subscription_count() < len(readers):
                return False
        return self.count_publishers(CMD_VEL.name) > 0 or not self._wait_for

    def _on_timer(self) -> None:
        if not self._started_ns:
            if not self._has_readers():
                return
            self._started_ns = 1 if self._lockstep else self.get_clock().now().nanoseconds
            self._measure()
        if self._lockstep:
            if time.monotonic() - self._published_at > REPEAT_S:
                self._publish_tick()
        else:
            self._follow_the_clock()

    def _follow_the_clock(self) -> None:
        physics = self.physics
        due_ns = self.get_clock().now().nanoseconds - self._started_ns
        while physics.now_ns + ODOMETRY_NS <= due_ns:
            physics.advance(physics.now_ns + ODOMETRY_NS, self._film_ns)
            self._measure()
            self._publish_odometry(self._started_ns + physics.now_ns)
        while self._scans and self._scans[0][0] + SCAN_AGE_NS <= due_ns:
            at_ns, scan = self._scans.pop(0)
            self._scan.publish(scan_msg(scan, self._started_ns + at_ns, SCAN_FRAME))

    def _measure(self) -> None:
        if self.physics.now_ns % SCAN_NS == 0:
            self._scans.append((self.physics.now_ns, self.physics.scan()))

    def _publish_tick(self) -> None:
        """Lockstep: scan and odometry of the present moment, maybe once more."""
        self._published_at = time.monotonic()
        at_ns, scan = self._scans[-1]
        self._scan.publish(scan_msg(scan, stamp_at(at_ns), SCAN_FRAME))
        self._publish_odometry(stamp_at(at_ns))

    def _publish_odometry(self, at_ns: int) -> None:
        odometry = self.physics.odometry
        velocity = towards((0.0, 0.0), odometry.pose.yaw, odometry.speed_mps)
        message = odometry_msg(
            odometry.pose, velocity, at_ns, ODOM_FRAME, BASE_FRAME, odometry.turn_radps
        )
        if self._tf:
            self._tf.publish(tf_msg(message))
        self._odom.publish(message)

    def _on_cmd_vel(self, message: TwistStamped) -> None:
        physics, twist = self.physics, message.twist
        if not self._lockstep:
            physics.command(twist.linear.x, twist.angular.z)
            return
        if not self._scans or stamp_ns(message.header.stamp) != stamp_at(physics.now_ns):
            return  # of a tick that was answered before
        tick_ns = physics.now_ns
        physics.advance(tick_ns + REACTION_NS, self._film_ns)
        physics.command(twist.linear.x, twist.angular.z)
        physics.advance(tick_ns + SCAN_NS, self._film_ns)
        self._scans.clear()
        self._measure()
        self._publish_tick()

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
