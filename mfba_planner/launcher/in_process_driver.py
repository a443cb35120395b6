# SPDX-License-Identifier: Apache-2.0
"""The in-process driver: all nodes on one executor in this process, over real DDS."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.parameter import Parameter

from ..core.errors import GraphError
from ..core.interrupts import interrupts_held
from ..ros.interface import parameters, topics
from ..ros.nodes.planner import PlannerNode
from ..ros.nodes.recorder import Recorder
from ..ros.nodes.virtual_sensor import VirtualSensor
from ..ros.nodes.world_sim import WorldSim
from ..ros.runtime.base_node import GraphNode
from ..ros.runtime.spin_node import make_executor
from ..scenarios.run_config import (
    NODES,
    READY_TIMEOUT_S,
    RunConfig,
    graph_parameters,
    recorder_parameters,
)
from .node_processes import NO_EXTRA_SERVICES

KINDS: dict[str, Callable[..., GraphNode]] = {
    topics.RECORDER: Recorder,
    topics.WORLD_SIM: WorldSim,
    topics.VIRTUAL_SENSOR: VirtualSensor,
    topics.PLANNER: PlannerNode,
}

DRAIN_SPINS = 500  # delivery within a process is synchronous: this empties all queues


def run_in_process(
    config: RunConfig,
    bag: Path | None,
    *,
    domain_id: int,
    timeout_s: float = 600.0,
    on_turn: Callable[[Any], bool] = lambda _: True,
) -> float:
    """Run the graph until goal or time limit; return the wall time of the loop, s.

    bag names the directory to record into, None for no recording. on_turn gets the World, of
    several robots the Fleet, after every spin of the executor and ends the run by returning
    False. Raises GraphError when the graph does not get ready or does not finish in time.
    """
    context = Context()
    with interrupts_held():  # by the middleware's threads, for ever
        context.init(domain_id=domain_id)
    with ExitStack() as stack:
        stack.callback(context.destroy)
        stack.callback(context.try_shutdown)
        peers = (*NODES, topics.RECORDER) if bag else NODES
        node_parameters = graph_parameters(config, peers)
        recorded_nodes = list(node_parameters)
        if bag:
            node_parameters = {
                topics.RECORDER: recorder_parameters(config, str(bag))
            } | node_parameters
        executor = make_executor(context)
        stack.callback(executor.shutdown)
        nodes: dict[str, Any] = {}
        for name, values in node_parameters.items():
            namespace, _, program = name.rpartition("/")
            with interrupts_held():
                node = KINDS[program](
                    context=context,
                    namespace=namespace,
                    parameter_overrides=_overrides(values | NO_EXTRA_SERVICES),
                    start_parameter_services=False,
                )
            stack.callback(node.destroy_node)
            stack.callback(node.close)
            executor.add_node(node)
            nodes[name] = node
        world: WorldSim = nodes[topics.WORLD_SIM]
        if bag:
            recorder: Recorder = nodes[topics.RECORDER]
            recorder.attach_parameters(
                {name: parameters.values(nodes[name]) for name in recorded_nodes}
            )
        _spin(
            executor,
            lambda: not _missing(nodes),
            READY_TIMEOUT_S + len(config.scenario.robots),
            lambda: _missing(nodes),
        )
        started = time.perf_counter()
        world.resume()
        _spin(
            executor,
            lambda: world.over or not on_turn(world.world),
            timeout_s,
            lambda: f"tick {world.world.tick} after {timeout_s:g} s",
        )
        wall_s = time.perf_counter() - started
        # The planner still commands the present tick; no further tick follows.
        world.tick_control.paused = True
        for _ in range(DRAIN_SPINS):
            executor.spin_once(timeout_sec=0.0)
        return wall_s


def _spin(
    executor: Any, done: Callable[[], bool], timeout_s: float, explain: Callable[[], str]
) -> None:
    deadline = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > deadline:
            raise GraphError(f"the graph is stuck: {explain()}; see the nodes' logs")
        executor.spin_once(timeout_sec=0.05)


def _missing(nodes: dict[str, GraphNode]) -> str:
    found = ((name, node.missing()) for name, node in nodes.items())
    return "; ".join(f"{name}: {what}" for name, what in found if what)


def _overrides(values: dict[str, Any]) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]
