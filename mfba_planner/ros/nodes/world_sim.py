# SPDX-License-Identifier: Apache-2.0
"""world_sim: publishes the world tick by tick, in lockstep with cmd_vel or on a wall timer.

A fleet's robots have their topics in their namespaces; one tick is everybody's.
"""

from __future__ import annotations

import time
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import SetBool, Trigger

from ...core.errors import ConfigError, InputError
from ...core.types import NANO
from ...recording.from_messages import pose2d
from ...simulation.episode import stamp_of
from ..endpoints.fleet_interface import FleetInterface
from ..endpoints.scenario_parameter import declare_scenario
from ..interface import parameters, topics
from ..node_parameters import WorldSimSettings, names
from ..runtime.node_runtime import GraphNode, Refusals, spin_node
from ..runtime.tick_control import TickControl


class WorldSim(GraphNode):
    """The simulated world of one scenario; a tick ends when all who are asked have answered."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a scenario or parameter that cannot be accepted."""
        super().__init__(topics.WORLD_SIM, **kwargs)
        self.settings = s = parameters.declare(self, WorldSimSettings(), read_only=True)
        self.scenario = declare_scenario(self, s.scenario)
        if s.run_on and self.scenario.robots:
            raise ConfigError("parameter run_on=True: a fleet's run ends; give false")
        self.tick_control = TickControl(s)
        self._refusals = Refusals(self)
        self._all = FleetInterface(self, s, self.scenario, self._refusals, self._look_for_answers)
        if not self.scenario.robots:
            self.listen(topics.INITIALPOSE, self._on_initialpose)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.advertise_ready(names(s.wait_for))
        period_s, on_timer = s.tick_ns * NANO / s.speed_factor, self._on_timer
        if s.lockstep:
            period_s, on_timer = min(s.answer_timeout_s / 4, 0.25), self._watch
        self.every(period_s, on_timer)
        self._begin(ticks_before=0)

    @property
    def world(self) -> Any:
        """The World as it is now; of several robots their Fleet."""
        return self._all.world

    @property
    def stamp_ns(self) -> int:
        """Stamp of the present tick; it never goes back, not even on ~/reset."""
        return stamp_of(self._ticks_before + self._all.tick, self.settings.tick_ns)

    def resume(self) -> None:
        """Go on from a pause; nothing when not paused."""
        if self.tick_control.resume():
            self._move_on()

    def _begin(self, ticks_before: int) -> None:
        self._ticks_before = ticks_before
        self.over, self._published = False, False
        self._all.begin(stamp_of(ticks_before, self.settings.tick_ns))

    def _move_on(self) -> None:
        """Do what was told last and publish the next tick, unless the run is over."""
        if not self._published or self._all.step():
            self._publish_tick()
        else:
            self.over = True
            self.get_logger().info(f"run over: {self._all.ends()} at tick {self._all.tick}")

    def _publish_tick(self) -> None:
        self._published = True
        self.tick_control.published(time.monotonic())
        self._all.publish(self.stamp_ns)

    def _on_timer(self) -> None:
        """Real time: one more tick; the first when everybody of wait_for is there."""
        if (
            not self.tick_control.paused
            and not self.over
            and (self._published or not self.missing())
        ):
            self._all.rest_if_silent()
            self._move_on()

    def _watch(self) -> None:
        """Lockstep: begin when everybody is there; publish an unanswered tick again."""
        self._look_for_answers()  # a goal_step may have come after its Twist
        if not self._published:
            if (
                self.tick_control.may_move_on()
                and self._all.have_subscribers
                and not self.missing()
            ):
                self._publish_tick()
        elif self.tick_control.must_repeat(time.monotonic(), self._all.tick):
            by = f" by {absent}" if (absent := self._all.absent()) else ""
            self.get_logger().warning(f"tick {self._all.tick} unanswered{by}: published again")
            self._all.publish_again(self.stamp_ns)

    def _look_for_answers(self) -> None:
        has_come = self.tick_control.is_open and self._all.have_answered(self.stamp_ns)
        if has_come and self.tick_control.answered():
            self._move_on()

    def _on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            self._all.robots[0].place.put(pose2d(message.pose.pose, "initialpose"))
        except InputError as error:
            self._refusals.add(error)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            self.tick_control.paused = True
        else:
            self.resume()
        response.success, response.message = True, "paused" if request.data else "running"
        return response

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = (
            "refused: the run is over; reset first"
            if self.over
            else self.tick_control.cannot_step()
        )
        if not refusal:
            self._move_on()
        response.success, response.message = not refusal, refusal or f"tick {self._all.tick}"
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._begin(self._ticks_before + self._all.tick + 1)
        if self.tick_control.answered():
            self._publish_tick()
        response.success, response.message = True, f"tick 0 at stamp {self.stamp_ns} ns"
        return response


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(WorldSim, args)
