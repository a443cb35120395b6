# SPDX-License-Identifier: Apache-2.0
"""One robot of the simulated world: its publishers and its command subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ...simulation.scenario import Scenario
from ...simulation.world import World
from ..node_settings import WorldSimSettings
from ..runtime.base_node import GraphNode
from ..runtime.refused_inputs import RefusedInputs
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
        refused_inputs: RefusedInputs,
        on_cmd_vel: Callable[[], None],
    ) -> None:
        """The name of a single robot is empty; reset() must be called first."""
        self.name = name
        self.world: World
        self.has_command = False  # lockstep: whether the present tick's was received
        graph: GraphNode | NamespacedNode = node
        if name:
            graph = NamespacedNode(node, name)
            settings = replace(
                settings,
                base_frame=f"{name}/{settings.base_frame}",
                scan_frame=f"{name}/{settings.scan_frame}",
            )
        self.publishers = WorldPublishers(graph, settings, scenario)
        self.commands = CommandSubscriptions(
            graph, settings, lambda: self.world, refused_inputs, on_cmd_vel
        )

    def reset(self, world: World, stamp_ns: int) -> None:
        """Start a run in this world, with the robot at its start."""
        self.world = world
        self.commands.stop()
        self.publishers.publish_start(world.scenario.goal_m, stamp_ns)

    def publish_tick(self, stamp_ns: int) -> None:
        """Publish the present tick."""
        self.publishers.publish_tick(self.world, self.commands.command, stamp_ns)
