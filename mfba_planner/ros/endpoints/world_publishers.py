# SPDX-License-Identifier: Apache-2.0
"""What world_sim says: the tick, the goal, how the run stands, and views for people."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from ...core.geometry import Point, towards
from ...simulation.episode import Outcome
from ...simulation.robot_model import Robot
from ...simulation.world import World
from ..interface import markers, to_messages, topics
from ..node_parameters import WorldSimSettings
from ..runtime.node_runtime import GraphNode
from .robot_namespace import NamespacedNode

TRAIL_POINTS = 500  # one per view period; the newest part of a longer trail is shown


class WorldPublishers:
    """The publishers of world_sim for one robot; the time is everybody's."""

    def __init__(
        self, node: GraphNode | NamespacedNode, settings: WorldSimSettings, robot: Robot
    ) -> None:
        """Advertise them all."""
        self._frame, self._base_frame = settings.odom_frame, settings.base_frame
        self._odom = node.advertise(topics.ODOM)
        errs = robot.noise.of_odometry
        self._truth = node.advertise(topics.GROUND_TRUTH) if errs else None
        # Of a robot with a lidar the sensor takes the scan; obstacles are for people and bags.
        self._scan_frame = settings.scan_frame
        self._scan = node.advertise(topics.SCAN) if robot.lidar.beams else None
        seen_by = () if self._scan else topics.OBSTACLES.readers
        self._obstacles = node.advertise(replace(topics.OBSTACLES, readers=seen_by))
        self._goal = node.advertise(topics.GOAL_POSE)
        self._outcome = node.advertise(topics.OUTCOME)
        self._trail = node.advertise(topics.TRAIL)
        self._markers = node.advertise(topics.MARKERS)
        self._tf = node.advertise(topics.TF) if topics.TF else None
        self._path: deque[Point] = deque(maxlen=TRAIL_POINTS)
        self._view = markers.RateLimit(settings.view_period_s)

    @property
    def have_subscribers(self) -> bool:
        """Whether somebody reads odom."""
        return bool(self._odom.get_subscription_count())

    def begin(self, goal: Point, stamp_ns: int) -> None:
        """A run begins: where it leads to, and that it is under way."""
        self._path.clear()
        self._goal.publish(to_messages.pose_stamped_msg(goal, stamp_ns, self._frame))
        self._outcome.publish(to_messages.outcome_msg(None, 0))

    def end(self, outcome: Outcome, ticks: int) -> None:
        """A run has ended."""
        self._outcome.publish(to_messages.outcome_msg(outcome, ticks))

    def tick(self, world: World, velocity: Point, stamp_ns: int) -> None:
        """One tick under one stamp; odom completes the sensor's pair, views can wait."""
        frame, reading = self._frame, world.read()
        centers = world.centers()
        turn = 0.0
        if world.scenario.robot.turns:
            velocity, turn = (
                towards((0.0, 0.0), reading.pose.yaw, world.speeds.v),
                world.speeds.omega,
            )
        odom = to_messages.odometry_msg(
            reading.pose, velocity, stamp_ns, frame, self._base_frame, turn
        )
        self._obstacles.publish(to_messages.obstacles_msg(centers, stamp_ns, frame))
        if self._tf:
            self._tf.publish(markers.tf_msg(odom))
        if self._truth:
            self._truth.publish(
                to_messages.odometry_msg(
                    world.pose, velocity, stamp_ns, frame, self._base_frame, turn
                )
            )
        if self._scan and reading.scan:
            self._scan.publish(to_messages.scan_msg(reading.scan, stamp_ns, self._scan_frame))
        self._odom.publish(odom)
        if self._view.due(stamp_ns):
            self._path.append(world.pose.position)
            self._trail.publish(to_messages.path_msg(list(self._path), stamp_ns, frame))
            self._markers.publish(markers.world_markers(world, stamp_ns, frame))
