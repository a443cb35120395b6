# SPDX-License-Identifier: Apache-2.0
"""world_sim of a fleet: every robot's topics in its namespace, one tick for all in lockstep."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from ..core.errors import ConfigError
from ..core.fleet import Fleet, Place
from ..core.geometry import Point
from ..node_settings import WorldSimSettings, names
from . import convert, params, topics
from .answer_topics import AnswerTopics
from .namespaced import Namespaced
from .pace import Pace
from .runtime import GraphNode, Refusals
from .world_params import declare_scenario
from .world_topics import WorldTopics


class FleetSim(GraphNode):
    """The simulated world of a scenario that names robots; a tick ends when all have answered."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError for a scenario or parameter that cannot be accepted."""
        super().__init__(topics.WORLD_SIM, **kwargs)
        self.settings = s = params.declare(self, WorldSimSettings(), read_only=True)
        self.scenario = declare_scenario(self, s.scenario)
        if not s.lockstep:
            raise ConfigError("parameter lockstep=False: a fleet has no wall timer; give true")
        self.world = Fleet(self.scenario, s.tick_ns, s.goal_tolerance_m, s.seed)
        self.over = False
        self.pace = Pace(s)
        self._published = False
        self._refusals = Refusals(self)
        self._time = self.advertise(topics.CLOCK)
        self._seats = [_Seat(self, s, place, self._refusals) for place in self.world.places]
        self._asked = list(self._seats)
        self.offer_ready(names(s.wait_for))
        self.every(min(s.answer_timeout_s / 4, 0.25), self._watch)

    @property
    def stamp_ns(self) -> int:
        """Stamp of the present tick."""
        return (self.world.tick + 1) * self.settings.tick_ns

    def resume(self) -> None:
        """Go on from a pause; nothing when not paused."""
        if self.pace.resume():
            self._move_on()

    def look_for_answers(self) -> None:
        """Take what the robots' planners have answered; the last answer moves the world on."""
        if not self.pace.is_open:
            return
        for seat in self._asked:
            seat.take(self.stamp_ns)
        if all(seat.answered for seat in self._asked) and self.pace.answered():
            self._move_on()

    def _move_on(self) -> None:
        """Do what was told last and publish the next tick, unless the run is over."""
        fleet, asked = self.world, self._asked
        if self._published:
            self._end(asked)
            self._asked = [self._seats[number] for number in fleet.under_way]
            if not self._asked:
                self.over = True
                self.get_logger().info(f"run over at tick {fleet.tick}")
                return
            fleet.step({number: self._seats[number].told for number in fleet.under_way})
        self._published = True
        self.pace.published(time.monotonic())
        for seat in self._asked:
            seat.answered = False
        self._tick()

    def _end(self, seats: list[_Seat]) -> None:
        for seat, outcome in zip(self._seats, self.world.outcomes):
            if seat in seats and outcome is not None:
                seat.out.end(outcome, self.world.tick + 1)

    def _tick(self) -> None:
        """Publish the present tick to everybody who has not answered it."""
        self._time.publish(convert.clock_msg(self.stamp_ns))
        for seat in self._asked:
            if not seat.answered:
                seat.out.tick(seat.place, seat.told, self.stamp_ns)

    def _watch(self) -> None:
        """Begin when everybody is there; publish an unanswered tick again."""
        self.look_for_answers()  # a goal_step may have come after its Twist
        if not self._published:
            if self.pace.may_move_on() and all(seat.out.are_heard for seat in self._seats):
                self._move_on()
        elif self.pace.must_repeat(time.monotonic(), self.world.tick):
            absent = ", ".join(seat.name for seat in self._asked if not seat.answered)
            self.get_logger().warning(
                f"tick {self.world.tick} unanswered by {absent}: published again"
            )
            self._tick()


class _Seat:
    """One robot's publishers, what its planner answers, and what it is told."""

    def __init__(
        self, sim: FleetSim, settings: WorldSimSettings, place: Place, refusals: Refusals
    ) -> None:
        self.place, self.name = place, place.name
        self.answered = False
        frames = {
            name: f"{self.name}/{getattr(settings, name)}" for name in ("base_frame", "scan_frame")
        }
        here = Namespaced(sim, self.name)
        robot = place.scenario.robot
        self.out = WorldTopics(here, replace(settings, **frames), robot, clock=False)  # type: ignore[arg-type]
        self._answers = AnswerTopics(here, settings, lambda: place, refusals, sim.look_for_answers)
        self.out.begin(place.scenario.goal_m, settings.tick_ns)

    @property
    def told(self) -> Point:
        """What the planner has told last, as World.step takes it."""
        return self._answers.told

    def take(self, stamp_ns: int) -> None:
        """Take the answer to this stamp, if it has come."""
        self.answered = self.answered or self._answers.take(stamp_ns)
