# SPDX-License-Identifier: Apache-2.0
"""All robots of the simulated world, and who of them the present tick is for."""

from __future__ import annotations

from collections.abc import Callable

from ...core.geometry import Point
from ...simulation.episode import Outcome
from ...simulation.fleet import Fleet
from ...simulation.scenario import Scenario
from ...simulation.world import World
from ..interface import conversions, topics
from ..node_parameters import WorldSimSettings
from ..runtime.node_runtime import GraphNode, Refusals
from .robot_interface import Seat


class Alone:
    """The world of one robot, handled as a Fleet is."""

    def __init__(self, world: World) -> None:
        """Take the world as it is."""
        self.world, self.places = world, [world]

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


class Company:
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
        self.seats = [
            Seat(node, settings, name, scenario, refusals, on_heard)
            for name in scenario.robot_names or ("",)
        ]

    @property
    def tick(self) -> int:
        """The present tick."""
        return self._all.tick

    @property
    def world(self) -> World | Fleet:
        """The world as it is now; of several robots their Fleet."""
        return self._all.world if isinstance(self._all, Alone) else self._all

    @property
    def are_heard(self) -> bool:
        """Whether somebody reads each robot's odom."""
        return all(seat.is_heard for seat in self.seats)

    def begin(self, stamp_ns: int) -> None:
        """All are at their starts, at tick 0, whose stamp this is."""
        s, scenario = self._settings, self._scenario
        told = (scenario, s.tick_ns, s.goal_tolerance_m, s.seed)
        self._all: Alone | Fleet = Fleet(*told) if scenario.robots else Alone(World(*told))
        for seat, place in zip(self.seats, self._all.places):
            seat.begin(place, stamp_ns)
        self._asked = dict(enumerate(self.seats))

    def publish(self, stamp_ns: int) -> None:
        """Publish the present tick to whom it is for; to others too in real time."""
        for seat in self.seats:
            seat.answered = False
        self.publish_again(stamp_ns)

    def publish_again(self, stamp_ns: int) -> None:
        """Publish the present tick to those who have not answered it."""
        self._time.publish(conversions.clock_msg(stamp_ns))
        # In real time a robot that has arrived must see on: its planner would call it blind.
        for seat in self._asked.values() if self._settings.lockstep else self.seats:
            if not seat.answered:
                seat.tick(stamp_ns)

    def have_answered(self, stamp_ns: int) -> bool:
        """Lockstep: whether all answers to this stamp have come."""
        for seat in self._asked.values():
            seat.take(stamp_ns)
        return all(seat.answered for seat in self._asked.values())

    def absent(self) -> str:
        """Lockstep: who has not answered; empty of one that is alone."""
        return ", ".join(seat.name for seat in self._asked.values() if not seat.answered)

    def rest_if_silent(self) -> None:
        """Real time: let those rest who have been told nothing for too long."""
        for seat in self.seats:
            seat.rest_if_silent()

    def step(self) -> bool:
        """Do what was told last; False, and nothing is done, when all have come to their end."""
        if not self._settings.run_on:
            self._end_who_is_there()
        if not self._asked:
            return False
        self._all.step({number: seat.told for number, seat in self._asked.items()})
        return True

    def _end_who_is_there(self) -> None:
        outcomes = self._all.outcomes
        for number, seat in [*self._asked.items()]:
            if outcome := outcomes[number]:
                seat.end(outcome)
                del self._asked[number]

    def ends(self) -> str:
        """How it ended, in words."""
        found = [outcome.value for outcome in self._all.outcomes if outcome]
        if len(found) == 1:
            return found[0]
        return ", ".join(f"{found.count(end)} {end}" for end in sorted({*found}))
