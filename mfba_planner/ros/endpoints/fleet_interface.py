# SPDX-License-Identifier: Apache-2.0
"""All robots of the simulated world, and who of them the present tick is for."""

from __future__ import annotations

from collections.abc import Callable

from ...core.geometry import Point
from ...simulation.episode import Outcome
from ...simulation.fleet import Fleet
from ...simulation.scenario import Scenario
from ...simulation.world import World
from ..interface import to_messages, topics
from ..node_parameters import WorldSimSettings
from ..runtime.node_runtime import GraphNode, Refusals
from .robot_interface import RobotInterface


class SingleRobot:
    """The world of one robot, handled as a Fleet is."""

    def __init__(self, world: World) -> None:
        """Take the world as it is."""
        self.world, self.robot_worlds = world, [world]

    @property
    def tick(self) -> int:
        """The present tick."""
        return self.world.tick

    @property
    def outcomes(self) -> list[Outcome | None]:
        """As Fleet.outcomes; of the robot as it is now, since somebody may have put it there."""
        return [self.world.outcome()]

    def step(self, told: dict[int, Point]) -> None:
        """As Fleet.step()."""
        self.world.step(told[0])


class FleetInterface:
    """One robot, or a fleet's: they move together, and arrive one by one."""

    def __init__(
        self,
        node: GraphNode,
        settings: WorldSimSettings,
        scenario: Scenario,
        refusals: Refusals,
        on_heard: Callable[[], None],
    ) -> None:
        """Advertise and subscribe for all; begin() comes before anything else."""
        self._settings, self._scenario = settings, scenario
        self._time = node.advertise(topics.CLOCK)
        self.robots = [
            RobotInterface(node, settings, name, scenario, refusals, on_heard)
            for name in scenario.robot_names or ("",)
        ]

    @property
    def tick(self) -> int:
        """The present tick."""
        return self._all.tick

    @property
    def world(self) -> World | Fleet:
        """The world as it is now; of several robots their Fleet."""
        return self._all.world if isinstance(self._all, SingleRobot) else self._all

    @property
    def have_subscribers(self) -> bool:
        """Whether somebody reads each robot's odom."""
        return all(robot.has_subscribers for robot in self.robots)

    def begin(self, stamp_ns: int) -> None:
        """All are at their starts, at tick 0, whose stamp this is."""
        s, scenario = self._settings, self._scenario
        told = (scenario, s.tick_ns, s.goal_tolerance_m, s.seed)
        self._all: SingleRobot | Fleet = (
            Fleet(*told) if scenario.robots else SingleRobot(World(*told))
        )
        for robot, place in zip(self.robots, self._all.robot_worlds):
            robot.begin(place, stamp_ns)
        self._asked = dict(enumerate(self.robots))

    def publish(self, stamp_ns: int) -> None:
        """Publish the present tick to whom it is for; to others too in real time."""
        for robot in self.robots:
            robot.answered = False
        self.publish_again(stamp_ns)

    def publish_again(self, stamp_ns: int) -> None:
        """Publish the present tick to those who have not answered it."""
        self._time.publish(to_messages.clock_msg(stamp_ns))
        # In real time a robot that has arrived must see on: its planner would call it blind.
        for robot in self._asked.values() if self._settings.lockstep else self.robots:
            if not robot.answered:
                robot.tick(stamp_ns)

    def have_answered(self, stamp_ns: int) -> bool:
        """Lockstep: whether all answers to this stamp have come."""
        for robot in self._asked.values():
            robot.take(stamp_ns)
        return all(robot.answered for robot in self._asked.values())

    def absent(self) -> str:
        """Lockstep: who has not answered; empty of one that is alone."""
        return ", ".join(robot.name for robot in self._asked.values() if not robot.answered)

    def rest_if_silent(self) -> None:
        """Real time: let those rest who have been told nothing for too long."""
        for robot in self.robots:
            robot.rest_if_silent()

    def step(self) -> bool:
        """Do what was told last; False, and nothing is done, when all have come to their end."""
        if not self._settings.run_on:
            self._end_who_is_there()
        if not self._asked:
            return False
        self._all.step({number: robot.told for number, robot in self._asked.items()})
        return True

    def _end_who_is_there(self) -> None:
        outcomes = self._all.outcomes
        for number, robot in [*self._asked.items()]:
            if outcome := outcomes[number]:
                robot.end(outcome)
                del self._asked[number]

    def ends(self) -> str:
        """How it ended, in words."""
        found = [outcome.value for outcome in self._all.outcomes if outcome]
        if len(found) == 1:
            return found[0]
        return ", ".join(f"{found.count(end)} {end}" for end in sorted({*found}))
