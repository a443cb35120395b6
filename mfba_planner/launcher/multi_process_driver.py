# SPDX-License-Identifier: Apache-2.0
"""The multi-process driver: one process per node, in a ROS domain of its own."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..core.errors import BagError, GraphError
from ..recording.bag_reader import BagReader
from ..recording.fleet_topics import NO_NAMESPACE, robot_topic
from ..ros.interface import topics
from ..scenarios.run_config import NODES, READY_TIMEOUT_S, graph_parameters, recorder_parameters
from .forked_process import ForkServer
from .graph_monitor import GraphMonitor
from .node_processes import NodeProcesses
from .ros_domain import private_domain
from .run_arguments import RECORDER
from .run_directory import RunDirectory
from .run_state import Run
from .stop_request import StoppedError

MORE_PER_ROBOT_S = 5.0
RESPONSE_TIMEOUT_S = 5.0
PAUSE_TIMEOUT_S = 1.0
LAST_DECISION_TIMEOUT_S = 2.0
POLL_PERIOD_S = 0.02


def run_multi_process(run: Run, fork_server: ForkServer) -> None:
    """Run the graph until goal or time limit; the bag is closed and complete afterwards.

    Raises GraphError for a node that ends or does not get ready, StoppedError for a run that is
    stopped from outside; the bag then holds the run until that moment. Raises BagError when the
    recorder missed a message.
    """
    run.console.log_to(run.directory.log)
    config = run.request.config
    parameters = graph_parameters(config, (*NODES, RECORDER))
    bag = str(run.directory.bag.absolute())
    # The recorder starts first, so that it misses no message.
    parameters = {RECORDER: recorder_parameters(config, bag, parameters)} | parameters
    with (
        private_domain(run.console.print_line) as domain,
        GraphMonitor(domain, config.scenario.robot_names or (NO_NAMESPACE,)) as monitor,
        NodeProcesses(
            fork_server, run.console.print_node_line, run.stop.is_urgent
        ) as node_processes,
    ):
        run.console.print_line(f"starting the nodes; watch with ROS_DOMAIN_ID={domain}")
        driver = _MultiProcessDriver(run, monitor, node_processes, list(parameters))
        node_processes.start(parameters, run.request.node_args)
        ticks = driver.run()
    if not config.real_time:
        require_complete(run.directory, ticks)


class _MultiProcessDriver:
    """Waits until all nodes are ready, resumes the world, waits for the end of the run."""

    def __init__(
        self, run: Run, monitor: GraphMonitor, node_processes: NodeProcesses, nodes: Sequence[str]
    ) -> None:
        self._started_at = time.monotonic()
        self._run = run
        self._monitor = monitor
        self._node_processes = node_processes
        self._nodes = nodes
        robots = len(run.request.config.scenario.robots)
        self._ready_timeout_s = READY_TIMEOUT_S + MORE_PER_ROBOT_S * robots

    def run(self) -> dict[str, int]:
        """Run from start to end; return each robot's number of ticks."""
        self._run.prepare_results()
        self._wait_until_ready()
        self._monitor.subscribe()
        self._run.start()
        try:
            self._resume_world()
            ticks = self._wait_until_over()
        except (GraphError, StoppedError):
            self._pause_world()
            raise
        self._run.end()
        self._wait_for_last_decision(ticks)
        return ticks

    def _check(self) -> None:
        self._node_processes.check()
        self._run.stop.check()

    def _wait(self, done: Callable[[], Any], timeout_s: float, explain: Callable[[], str]) -> None:
        """Spin until done; raise GraphError with explain() after timeout_s."""
        deadline = time.monotonic() + timeout_s
        while not done():
            self._check()
            if time.monotonic() > deadline:
                raise GraphError(f"{explain()} after {timeout_s:g} s; see the nodes' output above")
            self._monitor.spin(POLL_PERIOD_S)

    def _wait_until_ready(self) -> None:
        """Wait until every node is ready, so that no first message is lost."""
        ready_calls = self._monitor.call_ready(self._nodes)
        missing = dict.fromkeys(ready_calls, "no response yet")

        def all_ready() -> bool:
            if self._run.console.is_progress_due():
                ready = len(ready_calls) - len(missing)
                self._run.console.show_progress(f"{ready} of {len(ready_calls)} nodes are ready")
            for name in [*missing]:
                response = ready_calls[name].response()
                if response is not None:
                    missing[name] = response.message
                    if response.success:
                        del missing[name]
            return not missing

        self._wait(
            all_ready,
            self._ready_timeout_s,
            lambda: "not ready: " + "; ".join(f"{name}: {what}" for name, what in missing.items()),
        )
        self._node_processes.remove_parameter_files()
        took_s = time.monotonic() - self._started_at
        self._run.console.print_line(f"{len(ready_calls)} nodes are ready after {took_s:.1f} s")

    def _resume_world(self) -> None:
        pause_call = self._monitor.call_pause(False)
        self._wait(
            pause_call.response, RESPONSE_TIMEOUT_S, lambda: "no response from world_sim/pause"
        )

    def _wait_until_over(self) -> dict[str, int]:
        """Wait for the end of the run, polling, to avoid a wake-up for every message."""
        tick_ns = self._run.request.config.planner.tick_ns
        while (ticks := self._monitor.ticks_at_end()) is None:
            self._check()
            time.sleep(POLL_PERIOD_S)
            self._monitor.poll()
            if self._run.console.is_progress_due() and (now := self._monitor.progress()):
                self._run.show(now.stamp_ns // tick_ns - 1, now.distance_m, now.mode)
        return ticks

    def _wait_for_last_decision(self, ticks: Mapping[str, int]) -> None:
        """In real time the world does not wait for the planner: wait for its last decisions."""
        tick_ns = self._run.request.config.planner.tick_ns
        deadline = time.monotonic() + LAST_DECISION_TIMEOUT_S
        while time.monotonic() < deadline:
            received = self._monitor.stamps_ns()
            if all(received.get(robot, 0) >= count * tick_ns for robot, count in ticks.items()):
                return
            self._check()
            self._monitor.spin(POLL_PERIOD_S)

    def _pause_world(self) -> None:
        """Pause the world, if it runs, so that the bag ends with a whole tick."""
        pause_call = self._monitor.call_pause(True)
        deadline = time.monotonic() + PAUSE_TIMEOUT_S
        while pause_call.response() is None and time.monotonic() < deadline:
            if self._run.stop.is_urgent() or not self._node_processes.is_running(topics.WORLD_SIM):
                return
            self._monitor.spin(POLL_PERIOD_S)


def require_complete(directory: RunDirectory, ticks: Mapping[str, int]) -> None:
    """Raise BagError unless each topic of a robot's loop has a message for every tick."""
    with BagReader(directory.bag) as reader:
        counts = {name: topic.message_count for name, topic in reader.topics.items()}
    every_tick = [topic for topic in topics.GRAPH if topic.every_tick]
    for robot, topic in itertools.product(ticks, every_tick):
        name = topic.name if topic.name.startswith("/") else robot_topic(robot, f"/{topic.name}")
        if (found := counts.get(name, 0)) < ticks[robot]:
            remedy = "run again on a machine with less load" if found else f"see {directory.log}"
            raise BagError(
                f"{directory.bag}: incomplete, {found} of {ticks[robot]} messages on {name}; "
                f"{remedy}"
            )
