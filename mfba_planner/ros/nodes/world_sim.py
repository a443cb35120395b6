# SPDX-License-Identifier: Apache-2.0
"""world_sim: publishes the world tick by tick, in lockstep with cmd_vel or on a wall timer."""

from __future__ import annotations

import time
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import SetBool, Trigger

from ...core.errors import ConfigError, InputError
from ...core.planner_types import NANO
from ...recording.from_messages import pose2d
from ...simulation.episode import stamp_of
from ..endpoints.declare_scenario_parameter import declare_scenario
from ..endpoints.simulated_fleet_interface import FleetInterface
from ..endpoints.world_diagnostics import WorldDiagnostics
from ..interface import parameters, topics
from ..node_settings import WorldSimSettings, names
from ..runtime.base_node import GraphNode
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.spin_node import spin_node
from ..runtime.tick_control import TickControl


class WorldSim(GraphNode):
    """The simulated world of one scenario; the robots of a fleet share one tick.

    One tick: _publish_tick, then in lockstep _take_commands -> _advance, in real time _on_timer
    -> _advance.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a scenario or parameter that cannot be accepted."""
        super().__init__(topics.WORLD_SIM, **kwargs)
        self.settings = s = parameters.declare(self, WorldSimSettings(), read_only=True)
        self.scenario = declare_scenario(self, s.scenario)
        if s.run_on and self.scenario.robots:
            raise ConfigError("parameter run_on=True: a fleet's run ends; give false")
        self.tick_control = TickControl(s)
        self._refused_inputs = refused = RefusedInputs(self)
        self._fleet = FleetInterface(self, s, self.scenario, refused, self._take_commands)
        if not self.scenario.robots:
            self.subscribe(topics.INITIALPOSE, self._on_initialpose)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)
        self.create_service(Trigger, "~/reset", self._on_reset)
        WorldDiagnostics(self, s, lambda: self.stamp_ns)
        self.advertise_ready(names(s.wait_for))
        period_s, on_timer = s.tick_ns * NANO / s.speed_factor, self._on_timer
        if s.lockstep:
            period_s, on_timer = min(s.answer_timeout_s / 4, 0.25), self._on_lockstep_timer
        self.create_wall_timer(period_s, on_timer)
        self._reset(ticks_before=0)

    @property
    def world(self) -> Any:
        """The present World; of several robots their Fleet."""
        return self._fleet.world

    @property
    def stamp_ns(self) -> int:
        """Stamp of the present tick; it never goes back, not even on ~/reset."""
        return stamp_of(self._ticks_before + self._fleet.tick, self.settings.tick_ns)

    def resume(self) -> None:
        """End a pause; nothing when not paused."""
        if self.tick_control.resume():
            self._advance()

    def _reset(self, ticks_before: int) -> None:
        self._ticks_before = ticks_before
        self.over, self._published = False, False
        self._fleet.reset(stamp_of(ticks_before, self.settings.tick_ns))

    def _publish_tick(self) -> None:
        self._published = True
        self.tick_control.open_tick(time.monotonic())
        self._fleet.publish_tick(self.stamp_ns)

    def _take_commands(self) -> None:
        """Lockstep: advance once the commands of all active robots are received."""
        complete = self.tick_control.is_open and self._fleet.take_commands(self.stamp_ns)
        if complete and self.tick_control.close_tick():
            self._advance()

    def _advance(self) -> None:
        """Move the robots by their commands and publish the next tick, unless the run is over."""
        if not self._published or self._fleet.step():
            self._publish_tick()
        else:
            self.over = True
            text, tick = self._fleet.outcome_text(), self._fleet.tick
            self.get_logger().info(f"run over: {text} at tick {tick}")

    def _on_timer(self) -> None:
        """Real time: advance; the first tick waits for the nodes of wait_for."""
        if self.tick_control.paused or self.over:
            return
        if self._published or not self.missing():
            self._fleet.stop_if_timed_out()
            self._advance()

    def _on_lockstep_timer(self) -> None:
        """Publish tick 0 when all subscribers are there; repeat a tick without command."""
        self._take_commands()  # a goal_step may have been received after its Twist
        control, fleet = self.tick_control, self._fleet
        if not self._published:
            if control.may_advance() and fleet.have_subscribers and not self.missing():
                self._publish_tick()
        elif control.must_repeat(time.monotonic(), fleet.tick):
            of = f" of {robots}" if (robots := fleet.without_command()) else ""
            self.get_logger().warning(f"tick {fleet.tick}: no command{of}; published again")
            fleet.repeat_tick(self.stamp_ns)

    def _on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            self._fleet.robots[0].world.put(pose2d(message.pose.pose, "initialpose"))
        except InputError as error:
            self._refused_inputs.add(error)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            self.tick_control.paused = True
        else:
            self.resume()
        response.success, response.message = True, "paused" if request.data else "running"
        return response

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = "refused: the run is over; reset first" if self.over else ""
        refusal = refusal or self.tick_control.step_refusal()
        if not refusal:
            self._advance()
        response.success, response.message = not refusal, refusal or f"tick {self._fleet.tick}"
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._reset(self._ticks_before + self._fleet.tick + 1)
        if self.tick_control.close_tick():
            self._publish_tick()
        response.success, response.message = True, f"tick 0 at stamp {self.stamp_ns} ns"
        return response


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(WorldSim, args)
