# SPDX-License-Identifier: Apache-2.0
"""The simulated world of one robot, tick by tick: robot, obstacles, sensors, outcome; no ROS."""

from __future__ import annotations

from dataclasses import replace
from math import isnan

from ..core.errors import ConfigError
from ..core.geometry import Point, Pose2D, distance, rotated
from ..core.planner_types import NANO, Decision
from ..planning.differential_drive import Speeds, apply_command, command
from .batched_motion import Motion
from .episode import Outcome, stamp_of
from .nearby_obstacles import Nearby, NearbyObstacles
from .obstacle_motion import velocity_at
from .scenario import Scenario
from .sensor_noise import NoisySensors, Reading
from .triggered_motion import is_waiting, start_triggered
from .triggers import before_triggers

GOAL_SIGMAS = 4.0  # standard deviations of odometry by which the goal may be missed


def advance(pose: Pose2D, velocity: Point, tick_ns: int) -> Pose2D:
    """Pose of the omnidirectional robot after one tick at constant velocity (m/s); yaw is kept."""
    dt = tick_ns * NANO
    return Pose2D(pose.x + velocity[0] * dt, pose.y + velocity[1] * dt, pose.yaw)


class World:
    """State of the simulated world at one tick; the node world_sim wraps it.

    Obstacles that wait for a trigger start at the ticks at which the robot reaches it; `scenario`
    is that of the run so far.
    """

    def __init__(
        self, scenario: Scenario, tick_ns: int, goal_tolerance_m: float, seed: int = 0
    ) -> None:
        """Put the robot at the start, at tick 0; seed is that of the sensor noise.

        All triggers are unreached, even if the scenario is that of a run before. Raises
        ConfigError for a scenario of several robots.
        """
        if scenario.robots:
            raise ConfigError(
                f"scenario {scenario.name!r}: names {len(scenario.robots)} robots, not "
                "one; use simulation.fleet"
            )
        self.scenario = before_triggers(scenario)
        self.segments = scenario.segments
        self.tick_ns = tick_ns
        self.goal_tolerance_m = goal_tolerance_m
        self.tick = 0
        self.pose = Pose2D(*scenario.start_m)
        self.speeds = Speeds()  # of a differential drive
        self._instruments = NoisySensors(scenario, tick_ns, seed)
        self._read: tuple[int, Reading] | None = None
        self._set_obstacles()
        self._check_triggers()

    def _set_obstacles(self) -> None:
        self._nearby = NearbyObstacles(Motion(self.scenario), self.tick_ns)
        self._waits = any(map(is_waiting, self.scenario.obstacles))

    def _check_triggers(self) -> None:
        """Start the obstacles whose trigger is reached at this tick."""
        self.start_triggered([self.pose.position])

    def start_triggered(self, positions: list[Point]) -> None:
        """Start, at this tick, the obstacles whose trigger a robot at a position reaches."""
        if not self._waits:
            return
        obstacles = start_triggered(self.scenario.obstacles, self.time_s, positions)
        if obstacles != self.scenario.obstacles:
            self.scenario = replace(self.scenario, obstacles=obstacles)
            self._set_obstacles()

    def near(self, reach_m: float, position: Point | None = None) -> Nearby:
        """Indices, and (centre, enlarged radius), of the obstacles that may be within reach now.

        Reach is measured to the enlarged edge. In scenario order; none within reach is missing.
        """
        return self._nearby.at(self.tick, position or self.pose.position, reach_m)

    def centers(self) -> list[Point]:
        """Present centres of the obstacles that are there, in scenario order."""
        return [center for center in self.scenario.centers(self.time_s) if not isnan(center[0])]

    @property
    def distance_to_goal_m(self) -> float:
        """Distance to the goal."""
        return distance(self.pose.position, self.scenario.goal_m)

    def radius_m(self, index: int) -> float:
        """Radius of the obstacle with this index in near(), not enlarged."""
        return self.scenario.obstacles[index].radius_m

    def velocity(self, index: int) -> Point:
        """Present (vx, vy) in m/s of the obstacle with this index in near()."""
        return velocity_at(self.scenario.obstacles[index], self.time_s, self.scenario.walls)

    @property
    def stamp_ns(self) -> int:
        """Stamp of the present tick."""
        return stamp_of(self.tick, self.tick_ns)

    @property
    def time_s(self) -> float:
        """Time of the obstacles' motion, 0 at tick 0."""
        return self.tick * self.tick_ns * NANO

    def outcome(self) -> Outcome | None:
        """How the run has ended by the present tick; None while it runs."""
        # The robot stops where its odometry is at the goal; its true pose may be off by the noise.
        slack_m = GOAL_SIGMAS * self.scenario.robot.noise.odom_m
        if self.distance_to_goal_m <= self.goal_tolerance_m + slack_m:
            return Outcome.GOAL_REACHED
        if self.time_s >= self.scenario.time_limit_s:
            return Outcome.TIME_LIMIT
        return None

    def command(self, decision: Decision) -> Point:
        """The command of a decision as the base receives it, for step().

        A Twist is in the body frame: the planner turns its velocity by the heading that the
        odometry gives, the base has its true one.
        """
        given = command(decision, self.scenario.robot, self.tick_ns)
        if self.scenario.robot.turns:
            return given
        return rotated(rotated(given, -decision.pose.yaw), self.pose.yaw)

    def step(self, command: Point) -> None:
        """Advance by one tick with a command as from command()."""
        robot = self.scenario.robot
        if robot.turns:
            self.pose, self.speeds = apply_command(
                self.pose, self.speeds, command, robot, self.tick_ns
            )
        else:
            self.pose = advance(self.pose, command, self.tick_ns)
        before_s = self.time_s
        self.tick += 1
        for kidnapping in self.scenario.kidnappings:
            if before_s < kidnapping.at_s <= self.time_s:
                self.put(Pose2D(*kidnapping.to_m, self.pose.yaw))
        self._check_triggers()

    def follow(self, pose: Pose2D) -> None:
        """Advance by one tick to a pose, as recorded of a run, instead of by a command."""
        self.pose = pose
        self.tick += 1
        self._check_triggers()

    def put(self, pose: Pose2D) -> None:
        """Place the robot at a pose, at rest."""
        self.pose, self.speeds, self._read = pose, Speeds(), None

    def read(self) -> Reading:
        """Sensor reading of the present tick; further calls in a tick return the same."""
        robot = self.scenario.robot
        if not (robot.lidar.beams or robot.noise.affects_odometry):
            return Reading(self.pose, None)
        if self._read is None or self._read[0] != self.tick:
            surfaces: list[tuple[float, float, float]] = []
            if robot.lidar.beams:
                surfaces = [
                    (*center, self.radius_m(index))
                    for index, (center, _) in zip(*self.near(robot.lidar.range_max_m))
                ]
            self._read = self.tick, self._instruments.read(self.stamp_ns, self.pose, surfaces)
        return self._read[1]
