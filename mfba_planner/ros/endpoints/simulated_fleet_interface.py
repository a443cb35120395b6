# SPDX-License-Identifier: Apache-2.0
"""The robots of the simulated world: their topics, and the Fleet or World they move in."""

from __future__ import annotations

from collections.abc import Callable

from ...core.geometry import Point
from ...simulation.episode import Outcome
from ...simulation.fleet import Fleet
from ...simulation.scenario import Scenario
from ...simulation.world import World
from ..interface import topics
from ..interface.tick_serializers import ClockSerializer
from ..node_settings import WorldSimSettings
from ..runtime.base_node import GraphNode
from ..runtime.refused_inputs import RefusedInputs
from .simulated_robot_interface import RobotInterface


class SingleRobot:
    """The world of one robot, with the methods of a Fleet."""

    def __init__(self, world: World) -> None:
        """Take the world in its present state."""
        self.world, self.robot_worlds = world, [world]

    @property
    def tick(self) -> int:
        """The present tick."""
        return self.world.tick

    @property
    def outcomes(self) -> list[Outcome | None]:
        """As Fleet.outcomes; recomputed, since initialpose may have moved the robot."""
        return [self.world.outcome()]

    def step(self, commands: dict[int, Point]) -> None:
        """As Fleet.step()."""
        self.world.step(commands[0])


class FleetInterface:
    """One robot or a fleet: all move in one step, each is active until it has its outcome."""

    def __init__(
        self,
        node: GraphNode,
        settings: WorldSimSettings,
        scenario: Scenario,
        refused_inputs: RefusedInputs,
        on_cmd_vel: Callable[[], None],
    ) -> None:
        """Advertise and subscribe for all robots; reset() must be called first."""
        self._settings, self._scenario = settings, scenario
        self._clock = node.advertise(topics.CLOCK)
        self._serialized_clock = ClockSerializer()
        self.robots = [
            RobotInterface(node, settings, name, scenario, refused_inputs, on_cmd_vel)
            for name in scenario.robot_names or ("",)
        ]

    @property
    def tick(self) -> int:
        """The present tick."""
        return self._state.tick

    @property
    def world(self) -> World | Fleet:
        """The present World; of several robots their Fleet."""
        return self._state.world if isinstance(self._state, SingleRobot) else self._state

    @property
    def have_subscribers(self) -> bool:
        """Whether each robot's odom has a subscriber."""
        return all(robot.publishers.has_odom_subscriber for robot in self.robots)

    def reset(self, stamp_ns: int) -> None:
        """Put all robots at their starts, at tick 0, whose stamp this is."""
        s, scenario = self._settings, self._scenario
        arguments = (scenario, s.tick_ns, s.goal_tolerance_m, s.seed)
        self._state: SingleRobot | Fleet = (
            Fleet(*arguments) if scenario.robots else SingleRobot(World(*arguments))
        )
        for robot, world in zip(self.robots, self._state.robot_worlds):
            robot.reset(world, stamp_ns)
        self._active = dict(enumerate(self.robots))

    def publish_tick(self, stamp_ns: int) -> None:
        """Publish the present tick of the active robots; in real time of all."""
        for robot in self.robots:
            robot.has_command = False
        self.repeat_tick(stamp_ns)

    def repeat_tick(self, stamp_ns: int) -> None:
        """Publish the present tick of the robots whose command is missing."""
        self._clock.publish(self._serialized_clock(stamp_ns))
        # In real time robots that have arrived too: their planners would call their inputs stale.
        for robot in self._active.values() if self._settings.lockstep else self.robots:
            if not robot.has_command:
                robot.publish_tick(stamp_ns)

    def take_commands(self, stamp_ns: int) -> bool:
        """Lockstep: take the commands of this stamp; whether all active robots have theirs."""
        for robot in self._active.values():
            robot.has_command = robot.has_command or robot.commands.take(stamp_ns)
        return all(robot.has_command for robot in self._active.values())

    def without_command(self) -> str:
        """Lockstep: the robots whose command is missing; empty for a single robot."""
        return ", ".join(robot.name for robot in self._active.values() if not robot.has_command)

    def stop_if_timed_out(self) -> None:
        """Real time: stop the robots whose last command is too old."""
        for robot in self.robots:
            robot.commands.stop_if_timed_out()

    def step(self) -> bool:
        """Move the active robots by their commands; False, and nothing moves, if none is left."""
        if not self._settings.run_on:
            self._end_finished()
        if not self._active:
            return False
        self._state.step({n: robot.commands.command for n, robot in self._active.items()})
        return True

    def _end_finished(self) -> None:
        outcomes = self._state.outcomes
        for number, robot in [*self._active.items()]:
            if outcome := outcomes[number]:
                robot.publishers.publish_outcome(outcome, robot.world.tick + 1)
                del self._active[number]

    def outcome_text(self) -> str:
        """The outcomes of all robots in words."""
        found = [outcome.value for outcome in self._state.outcomes if outcome]
        if len(found) == 1:
            return found[0]
        return ", ".join(f"{found.count(text)} {text}" for text in sorted({*found}))
