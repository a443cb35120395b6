# SPDX-License-Identifier: Apache-2.0
"""world_sim: publishes the world tick by tick, in lockstep with cmd_vel or on a wall timer."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from std_srvs.srv import SetBool, Trigger

from ..core.episode import World
from ..core.errors import GraphError, InputError
from ..core.geometry import Point
from ..core.planner import NANO
from ..messages import pose2d, rotated, velocity
from ..scenarios import load_scenario, scenario_to_json
from . import markers, params, topics
from .convert import (
    clock_msg,
    obstacles_msg,
    odometry_msg,
    outcome_msg,
    path_msg,
    pose_stamped_msg,
)
from .runtime import GraphNode, Refusals, spin_node
from .settings import WorldSimSettings, names

TRAIL_POINTS = 500  # one per view period; the newest part of a longer trail is shown


class WorldSim(GraphNode):
    """The simulated world of one scenario."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a scenario or parameter that cannot be accepted."""
        super().__init__(topics.WORLD_SIM, **kwargs)
        self.settings = s = params.declare(self, WorldSimSettings(), read_only=True)
        self.scenario = load_scenario(s.scenario)
        # The whole scenario as a parameter: whoever records the parameters has it all.
        self.declare_parameter("scenario_json", scenario_to_json(self.scenario))
        self.world = World(self.scenario, s.tick_ns, s.goal_tolerance_m)
        self.over = False
        self._base_tick = 0
        self._velocity: Point = (0.0, 0.0)
        self._paused, self._single = s.start_paused, False
        self._awaiting, self._published, self._retries = False, False, 0
        self._published_at = 0.0
        self._trail: deque[Point] = deque(maxlen=TRAIL_POINTS)
        self._next_view_ns = 0
        self._refusals = Refusals(self)
        self._clock_pub = self.advertise(topics.CLOCK)
        self._odom = self.advertise(topics.ODOM)
        self._obstacles = self.advertise(topics.OBSTACLES)
        self._goal = self.advertise(topics.GOAL_POSE)
        self._outcome = self.advertise(topics.OUTCOME)
        self._trail_pub = self.advertise(topics.TRAIL)
        self._markers = self.advertise(topics.MARKERS)
        self._tf = self.advertise(topics.TF) if topics.TF else None
        kind = TwistStamped if s.enable_stamped_cmd_vel else None
        self.listen(topics.CMD_VEL, self._on_cmd_vel, kind)
        self.listen(topics.INITIALPOSE, self._on_initialpose)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.offer_ready(names(s.wait_for))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        if s.lockstep:
            self.create_timer(min(s.answer_timeout_s / 4, 0.25), self._watch, clock=steady)
            if not self._paused:
                self._first = self.create_timer(0.0, self._start, clock=steady)
        else:
            period = s.tick_ns * NANO / s.speed_factor
            self.create_timer(period, self._on_timer, clock=steady)
        self._announce()

    @property
    def stamp_ns(self) -> int:
        """Stamp of the present tick; it never goes back, not even on ~/reset."""
        return self.world.stamp_ns + self._base_tick * self.settings.tick_ns

    def _start(self) -> None:
        self._first.cancel()
        if not self._published:
            self._publish_tick()

    def _on_timer(self) -> None:
        if not (self._paused and not self._single) and not self.over:
            self._single = False
            self._move_on()

    def _move_on(self) -> None:
        """Apply the newest velocity and publish the next tick, unless the run is over."""
        if not self._published:
            self._publish_tick()
            return
        outcome = None if self.settings.run_on else self.world.outcome()
        if outcome is not None:
            self.over = True
            self._outcome.publish(outcome_msg(outcome, self.world.tick + 1))
            self.get_logger().info(f"run over: {outcome.value} at tick {self.world.tick}")
            return
        self.world.step(self._velocity)
        self._publish_tick()

    def _publish_tick(self) -> None:
        s, stamp = self.settings, self.stamp_ns
        self._published, self._awaiting = True, s.lockstep
        self._published_at = time.monotonic()
        self._retries = 0
        centers = self.scenario.centers(self.world.time_s)
        pose = self.world.pose
        self._clock_pub.publish(clock_msg(stamp))
        self._obstacles.publish(obstacles_msg(centers, stamp, s.odom_frame))
        odom = odometry_msg(pose, self._velocity, stamp, s.odom_frame, s.base_frame)
        if self._tf:
            self._tf.publish(markers.tf_msg(odom))
        if stamp >= self._next_view_ns:
            self._next_view_ns = stamp + round(s.view_period_s / NANO)
            self._trail.append(pose.position)
            self._trail_pub.publish(path_msg(list(self._trail), stamp, s.odom_frame))
            self._markers.publish(markers.world_markers(self.world, stamp, s.odom_frame))
        self._odom.publish(odom)

    def _announce(self) -> None:
        goal = self.scenario.goal_m
        self._goal.publish(pose_stamped_msg(goal, self.stamp_ns, self.settings.odom_frame))
        self._outcome.publish(outcome_msg(None, 0))

    def _on_cmd_vel(self, message: Any) -> None:
        try:
            vx, vy, _ = velocity(message)
            self._velocity = rotated((vx, vy), self.world.pose.yaw)
        except InputError as error:
            self._refusals.add(error)
            self._velocity = (0.0, 0.0)
        if self._awaiting:
            self._awaiting = False
            if not self._paused:
                self._move_on()

    def _watch(self) -> None:
        """Lockstep: publish an unanswered tick again, for a planner that was restarted."""
        waited = time.monotonic() - self._published_at
        if not self._awaiting or waited < self.settings.answer_timeout_s:
            return
        if self.world.tick == 0 and self._odom.get_subscription_count() == 0:
            return  # nobody there yet: that is no failure
        if self._retries >= self.settings.answer_retries:
            raise GraphError(
                f"tick {self.world.tick}: no cmd_vel after {self._retries + 1} times "
                f"{self.settings.answer_timeout_s:g} s; is the planner running?"
            )
        retries = self._retries + 1
        self.get_logger().warning(f"tick {self.world.tick} unanswered: published again")
        self._publish_tick()
        self._retries = retries

    def _on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            self.world.pose = pose2d(message.pose.pose, "initialpose")
        except InputError as error:
            self._refusals.add(error)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            self._paused = True
        else:
            self.resume()
        response.success = True
        response.message = "paused" if self._paused else "running"
        return response

    def resume(self) -> None:
        """Go on from a pause; nothing when not paused."""
        was, self._paused = self._paused, False
        if self.settings.lockstep and was and not self._awaiting:
            self._move_on()

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._paused and not self._awaiting and not self.over
        response.message = f"tick {self.world.tick}"
        if not response.success:
            response.message = "refused: pause first" if not self._paused else "refused: tick open"
        elif self.settings.lockstep:
            self._move_on()
        else:
            self._single = True
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        s = self.settings
        self._base_tick += self.world.tick + 1
        self.world = World(self.scenario, s.tick_ns, s.goal_tolerance_m)
        self._velocity, self.over = (0.0, 0.0), False
        self._trail.clear()
        self._announce()
        self._published = False
        if s.lockstep and not self._paused:
            self._publish_tick()
        response.success, response.message = True, f"tick 0 at stamp {self.stamp_ns} ns"
        return response


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(WorldSim, args)
