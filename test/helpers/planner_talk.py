# SPDX-License-Identifier: Apache-2.0
"""A planner node with its inputs published by hand and its outputs collected, for tests."""

import math
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from ros_graph import Graph
from sensor_msgs.msg import LaserScan

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Mode, Ranges
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import odometry_msg, pose_stamped_msg, sectors_msg
from mfba_planner.ros.nodes.planner import PlannerNode

INF, NAN = math.inf, math.nan
FREE: Ranges = (INF,) * 12
NORTH_EAST = (0.5, *FREE[1:])  # sector 1 is set
GOAL = (10.0, 5.0)
LOCKSTEP = {"lockstep": True, "seed": 3}


def odom(stamp: int, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Odometry:
    return odometry_msg(Pose2D(x, y, yaw), (0.0, 0.0), stamp, "odom", "base_link")


def sectors(stamp: int, ranges: Ranges = FREE) -> LaserScan:
    return sectors_msg(ranges, SensorParams(sectors=len(ranges)), 0.3, stamp, "odom")


def goal(x: float, y: float) -> PoseStamped:
    return pose_stamped_msg((x, y), 1, "odom")


class PlannerHarness:
    """A planner node, publishers of its inputs and lists of its outputs."""

    def __init__(
        self, graph: Graph, parameters: dict[str, Any], at: tuple[float, float] | None = GOAL
    ) -> None:
        self.graph = graph
        self.odom = graph.writer(topics.ODOM)
        self.sectors = graph.writer(topics.SECTORS)
        self.goal = graph.writer(topics.GOAL_POSE)
        self.waypoints = graph.writer(topics.WAYPOINTS)
        self.decisions = graph.collect(topics.DECISION)
        self.plans = graph.collect(topics.PLAN)
        self.goal_steps = graph.collect(topics.GOAL_STEP)
        stamped = parameters.get("enable_stamped_cmd_vel")
        self.cmd_vel = graph.collect(topics.CMD_VEL, TwistStamped if stamped else None)
        if at:
            self.goal.publish(goal(*at))  # latched
        self.node = graph.start(PlannerNode, parameters)
        if at:
            graph.until(lambda: self.node.goals.goal_queue.goal is not None)

    def decide_all(self, *messages: Any) -> list[Any]:
        """Publish the messages one after another; return the decisions that follow."""
        count, twists = len(self.decisions), len(self.cmd_vel)
        writers: dict[Any, Any] = {Odometry: self.odom, LaserScan: self.sectors}
        writers |= {PoseStamped: self.goal, Path: self.waypoints}
        for message in messages:
            writers[type(message)].publish(message)
            if isinstance(message, PoseStamped | Path):
                self.graph.settle()
        self.graph.settle()
        decisions = self.decisions[count:]
        assert len(self.cmd_vel) - twists == len(decisions), "each decision has its Twist"
        return decisions

    def decide(self, *messages: Any) -> Any:
        """As decide_all, where one decision follows."""
        (only,) = self.decide_all(*messages)
        return only

    @property
    def velocity(self) -> tuple[float, float]:
        """The Twist of the last decision."""
        twist = getattr(self.cmd_vel[-1], "twist", self.cmd_vel[-1])
        return (twist.linear.x, twist.linear.y)


def fields(message: Any) -> dict[str, str]:
    (status,) = message.status
    return {item.key: item.value for item in status.values} | {"reason": status.message}


def mode(message: Any) -> Mode:
    return Mode(fields(message)["mode"])
