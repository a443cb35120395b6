# SPDX-License-Identifier: Apache-2.0
"""LaserScan and Odometry with changed fields into live nodes: no exception, no unsafe command."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import rclpy
from fuzz_inputs import Rng, pick
from geometry_msgs.msg import Pose, PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from mfba_planner.core.errors import MfbaError
from mfba_planner.launcher.ros_domain import claim_domain
from mfba_planner.recording.from_messages import FARTHEST_M
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import time_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.runtime.spin_node import make_executor

BEAMS = 90
QUIET_S, ANSWER_S = 0.003, 2.0
_FLOATS = [
    math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-30, -1.0, 1e-3, 1.0, 3.5, 1e6, 9.9e6, 3e38, -3e38,
    math.pi, -math.pi, 2.0 * math.pi,
]  # fmt: skip
_SCAN_FIELDS = (
    "angle_min", "angle_max", "angle_increment", "range_min", "range_max", "scan_time",
    "time_increment",
)  # fmt: skip
_FRAMES = ["", "odom", "map", "base_link", "é" * 50, "x" * 5000]


class Nodes:
    """virtual_sensor and planner with a goal 10 m ahead, one pair per planner."""

    def __init__(self, _: Path) -> None:
        """Start all in this process, in a domain of their own."""
        domain, self._lock = claim_domain()
        self._context = Context()
        self._context.init(domain_id=domain)
        self._executor = make_executor(self._context)
        self._probe = rclpy.create_node("probe", context=self._context)
        self._executor.add_node(self._probe)
        self._nodes = [self._probe]
        self._pairs = [self._start(method) for method in ("paper", "predictive")]

    def _start(self, method: str) -> Any:
        values: dict[str, Any] = {"input_timeout_s": 5.0}
        for kind, more in ((VirtualSensor, {"source": "scan"}), (PlannerNode, {"method": method})):
            given = [Parameter(name, value=value) for name, value in {**values, **more}.items()]
            # Without services, of which each would cost time in each wait.
            node = kind(
                context=self._context, namespace=method, parameter_overrides=given,
                start_parameter_services=False,
            )  # fmt: skip
            self._executor.add_node(node)
            self._nodes.append(node)
        odom, scan = (
            self._probe.create_publisher(topic.type, f"{method}/{topic.name}", topic.qos)
            for topic in (topics.ODOM, topics.SCAN)
        )
        goal = self._probe.create_publisher(
            PoseStamped, f"{method}/{topics.GOAL_POSE.name}", topics.GOAL_POSE.qos
        )
        commands: list[Twist] = []
        self._probe.create_subscription(Twist, f"{method}/cmd_vel", commands.append, 10)
        message = PoseStamped()
        message.pose.position.x = 10.0
        goal.publish(message)
        self._settle()
        return odom, scan, commands

    def close(self) -> None:
        """End the nodes and free their domain."""
        for node in self._nodes:
            node.destroy_node()
        self._executor.shutdown()
        self._context.shutdown()
        self._lock.close()

    def _settle(self) -> None:
        """Spin until nothing came in four waits; a single one may be long on a busy machine."""
        quiet = 0
        while quiet < 4:
            start_s = time.monotonic()
            self._executor.spin_once(timeout_sec=QUIET_S)
            quiet = quiet + 1 if time.monotonic() - start_s >= QUIET_S else 0

    def __call__(self, rng: Rng, _: Path) -> None:
        """Good odometry and scan, then one of them changed; a bad one must stop the robot."""
        odom, scan, commands = pick(rng, self._pairs)
        commands.clear()
        odom.publish(_odometry())
        scan.publish(_scan())
        end_s = time.monotonic() + ANSWER_S
        while not commands and time.monotonic() < end_s:
            self._executor.spin_once(timeout_sec=QUIET_S)
        self._settle()
        commands.clear()
        unusable = False
        if rng.integers(2):
            message = _scan()
            unusable = _change_scan(rng, message)
            odom.publish(_odometry())
        else:
            message = _odometry()
            unusable = _change_odometry(rng, message)
        (scan if isinstance(message, LaserScan) else odom).publish(message)
        if isinstance(message, Odometry):
            scan.publish(_scan())
        self._settle()
        for command in commands:
            parts = (command.linear.x, command.linear.y, command.angular.z)
            if not all(map(math.isfinite, parts)):
                raise AssertionError(f"command {parts} on {message}")
        if unusable and commands and _speed(commands[-1]) > 0.0:
            raise AssertionError(f"command {commands[-1]} on unusable {message}")
        if unusable:
            raise MfbaError("unusable")


def _speed(command: Twist) -> float:
    return abs(command.linear.x) + abs(command.linear.y) + abs(command.angular.z)


def _header(frame: str) -> Header:
    return Header(stamp=time_msg(time.time_ns()), frame_id=frame)


def _odometry() -> Odometry:
    message = Odometry(header=_header("odom"), child_frame_id="base_link")
    message.pose.pose.orientation.w = 1.0
    return message


def _scan() -> LaserScan:
    width = 2.0 * math.pi / BEAMS
    return LaserScan(
        header=_header("base_scan"), ranges=[math.inf] * BEAMS, angle_min=-math.pi,
        angle_max=math.pi - width, angle_increment=width, range_min=0.1, range_max=10.0,
    )  # fmt: skip


def _change_odometry(rng: Rng, message: Odometry) -> bool:
    """Change some fields; return whether the result must not be driven on."""
    pose: Pose = message.pose.pose
    bad: dict[str, bool] = {}
    for _ in range(int(rng.integers(1, 3))):
        value = pick(rng, _FLOATS)
        kind = rng.integers(6)
        if kind < 2:
            part, axis = (
                (pose.position, pick(rng, "xy")) if kind else (pose.orientation, pick(rng, "xyzw"))
            )
            setattr(part, axis, value)
            bad[f"{kind}{axis}"] = not abs(value) <= FARTHEST_M
        elif kind == 2:
            message.header.frame_id = pick(rng, _FRAMES)
            bad["frame"] = message.header.frame_id != "odom"
        elif kind == 3:
            message.header.stamp = time_msg(int(pick(rng, [0, 1, 2**31 * 10**9 - 1])))
            bad["stamp"] = True
        elif kind == 4:
            message.pose.covariance[int(rng.integers(36))] = value
        else:
            setattr(message.twist.twist.linear, pick(rng, "xyz"), value)
    return any(bad.values())


def _contradicts_itself(message: LaserScan) -> bool:
    """Whether the angles make another number of beams than there are ranges."""
    beams, step = len(message.ranges), message.angle_increment
    turn_rad = message.angle_max - message.angle_min
    if (beams == 1 and 0.0 in (turn_rad, step)) or message.angle_min == message.angle_max == 0.0:
        return False  # some drivers leave them out
    # One more or less is a driver's rounding, of which large scans have more.
    return not (step and abs(turn_rad / step + 1.0 - beams) <= max(1.5, 0.1 * beams))


def _change_scan(rng: Rng, message: LaserScan) -> bool:
    """Change some fields; return whether the result must not be driven on."""
    bad: dict[str, bool] = {}
    for _ in range(int(rng.integers(1, 3))):
        kind = rng.integers(5)
        if kind == 0:
            ranges = rng.choice(_FLOATS, BEAMS)
            message.ranges = ranges.astype("float32").clip(-3e38, 3e38).tolist()
            bad["ranges"] = False
        elif kind == 1:
            message.ranges = [math.nan] * int(pick(rng, [0, 1, BEAMS, 5000]))
            bad["ranges"] = True
        elif kind == 2:
            message.ranges = [pick(rng, [1.0, math.inf])] * int(pick(rng, [0, 1, 7, 5000, 70_000]))
            bad["ranges"] = False
        elif kind == 3:
            value = pick(rng, _FLOATS)
            name = pick(rng, _SCAN_FIELDS)
            setattr(message, name, value)
            bad[name] = not math.isfinite(value) and name in _SCAN_FIELDS[:3]
        else:
            message.header.stamp = time_msg(int(pick(rng, [0, 1, 2**31 * 10**9 - 1])))
            bad["stamp"] = True
    bad["beams"] = _contradicts_itself(message)
    return any(bad.values())
