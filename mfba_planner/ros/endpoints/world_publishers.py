# SPDX-License-Identifier: Apache-2.0
"""world_sim's publishers of one robot: the tick, the goal, the outcome, and views for people."""

from __future__ import annotations

from dataclasses import replace

from ...core.geometry import Point, towards
from ...simulation.episode import Outcome
from ...simulation.scenario import Scenario
from ...simulation.scenario_map import scenario_grid
from ...simulation.world import World
from ..interface import markers, to_messages, topics
from ..interface.tick_serializers import ObstaclesSerializer, OdometrySerializer
from ..node_settings import WorldSimSettings
from ..runtime.base_node import GraphNode
from .robot_namespace import NamespacedNode


class WorldPublishers:
    """The publishers of world_sim for one robot; /clock is FleetInterface's."""

    def __init__(
        self, node: GraphNode | NamespacedNode, settings: WorldSimSettings, scenario: Scenario
    ) -> None:
        """Advertise all topics. Raises ConfigError where publish_map needs too large a map."""
        robot = scenario.robot
        self._frame, self._base_frame = settings.odom_frame, settings.base_frame
        self._serialized_odom = OdometrySerializer(self._frame, self._base_frame)
        self._serialized_obstacles = ObstaclesSerializer(self._frame)
        self._odom = node.advertise(topics.ODOM)
        noisy = robot.noise.affects_odometry
        self._truth = node.advertise(topics.GROUND_TRUTH) if noisy else None
        # With a lidar virtual_sensor reads scan; obstacles is then for people and bags only.
        self._scan_frame = settings.scan_frame
        self._scan = node.advertise(topics.SCAN) if robot.lidar.beams else None
        readers = () if self._scan else topics.OBSTACLES.readers
        self._obstacles = node.advertise(replace(topics.OBSTACLES, readers=readers))
        self._goal = node.advertise(topics.GOAL_POSE)
        self._map, self._grid = None, None
        if settings.publish_map:  # planner/ready waits for it
            self._map = node.advertise(replace(topics.MAP, readers=()))
            self._grid = scenario_grid(scenario)
        self._outcome = node.advertise(topics.OUTCOME)
        self._trail = node.advertise(topics.TRAIL)
        self._markers = node.advertise(topics.MARKERS)
        self._tf = None
        if topics.TRANSFORMS:
            self._tf, self._tf_static = map(node.advertise, topics.TRANSFORMS)
            if self._scan:
                self._tf_static.publish(
                    markers.lidar_tf_msg(robot.lidar, self._base_frame, self._scan_frame)
                )
        self._positions = markers.Trail(self._frame)
        self._view = markers.RateLimit(settings.view_period_s)

    @property
    def has_odom_subscriber(self) -> bool:
        """Whether odom has a subscriber."""
        return bool(self._odom.get_subscription_count())

    def publish_start(self, goal: Point, stamp_ns: int) -> None:
        """Publish a new run's map and goal, and that it is running."""
        self._positions.clear()
        if self._map and self._grid:
            grid = self._grid._replace(stamp_ns=stamp_ns)
            self._map.publish(to_messages.occupancy_grid_msg(grid, self._frame))
        self._goal.publish(to_messages.pose_stamped_msg(goal, stamp_ns, self._frame))
        self._outcome.publish(to_messages.outcome_msg(None, 0))

    def publish_outcome(self, outcome: Outcome, ticks: int) -> None:
        """Publish how the run has ended."""
        self._outcome.publish(to_messages.outcome_msg(outcome, ticks))

    def publish_tick(self, world: World, velocity: Point, stamp_ns: int) -> None:
        """Publish one tick: the sensor's inputs first, odom last of them; then views."""
        frame, reading = self._frame, world.read()
        turn = 0.0
        if world.scenario.robot.turns:
            velocity, turn = (
                towards((0.0, 0.0), reading.pose.yaw, world.speeds.v),
                world.speeds.omega,
            )
        self._obstacles.publish(self._serialized_obstacles(world.centers(), stamp_ns))
        if self._tf:
            odom = to_messages.odometry_msg(
                reading.pose, velocity, stamp_ns, frame, self._base_frame, turn
            )
            self._tf.publish(markers.tf_msg(odom))
        if self._truth:
            self._truth.publish(self._serialized_odom(world.pose, velocity, stamp_ns, turn))
        if self._scan and reading.scan:
            self._scan.publish(to_messages.scan_msg(reading.scan, stamp_ns, self._scan_frame))
        self._odom.publish(self._serialized_odom(reading.pose, velocity, stamp_ns, turn))
        if self._view.due(stamp_ns):
            self._trail.publish(self._positions.add(world.pose.position, stamp_ns))
            self._markers.publish(markers.world_markers(world, stamp_ns, frame))
