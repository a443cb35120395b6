# SPDX-License-Identifier: Apache-2.0
"""One robot of the simulated world: what it is shown, and what its planner answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ...core.geometry import Point
from ...simulation.episode import Outcome
from ...simulation.scenario import Scenario
from ...simulation.world import World
from ..node_parameters import WorldSimSettings
from ..runtime.node_runtime import GraphNode, Refusals
from .command_subscriptions import CommandSubscriptions
from .robot_namespace import NamespacedNode
from .world_publishers import WorldPublishers


class RobotInterface:
    """One robot's publishers and subscriptions, in its namespace if it is one of a fleet."""

    def __init__(
        self,
        node: GraphNode,
        settings: WorldSimSettings,
        name: str,
        scenario: Scenario,
        refusals: Refusals,
        on_heard: Callable[[], None],
    ) -> None:
        """Of one robot that is alone the name is empty; begin() comes before anything else."""
        self.name = name
        self.answered = False
        self.place: World
        here: GraphNode | NamespacedNode = node
        if name:
            here = NamespacedNode(node, name)
            settings = replace(
                settings,
                base_frame=f"{name}/{settings.base_frame}",
                scan_frame=f"{name}/{settings.scan_frame}",
            )
        self._out = WorldPublishers(here, settings, scenario.robot)
        self._commands = CommandSubscriptions(
            here, settings, lambda: self.place, refusals, on_heard
        )

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody reads the robot's odom."""
        return self._out.have_subscribers

    @property
    def told(self) -> Point:
        """What the planner has told last, as World.step takes it."""
        return self._commands.told

    def begin(self, place: World, stamp_ns: int) -> None:
        """A run begins, with the robot at its start."""
        self.place = place
        self._commands.rest()
        self._out.begin(place.scenario.goal_m, stamp_ns)

    def tick(self, stamp_ns: int) -> None:
        """Publish the present tick."""
        self._out.tick(self.place, self.told, stamp_ns)

    def take(self, stamp_ns: int) -> None:
        """Lockstep: take the answer to this stamp, if it has come; it will be obeyed."""
        self.answered = self.answered or self._commands.take(stamp_ns)

    def rest_if_silent(self) -> None:
        """Real time: rest where nothing has been told for too long."""
        self._commands.rest_if_silent()

    def end(self, outcome: Outcome) -> None:
        """The run has ended for this robot, at the present tick."""
        self._out.end(outcome, self.place.tick + 1)
