# SPDX-License-Identifier: Apache-2.0
"""The multi-process driver: every node a process of its own, in a domain of its own."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..core.errors import BagError, GraphError
from ..recording.bag_reader import BagReader
from ..recording.robot_topics import NO_NAMESPACE, below
from ..ros.interface import topics
from ..scenarios.run_config import NODES, READY_TIMEOUT_S, graph_parameters, recorder_parameters
from .graph_monitor import Monitor
from .node_processes import NodeProcesses
from .ros_domain import private_domain
from .run import Run
from .run_arguments import RECORDER
from .run_directory import RunDirectory
from .stop_request import StoppedError

MORE_PER_ROBOT_S = 5.0
ANSWER_TIMEOUT_S = 5.0
FREEZE_TIMEOUT_S = 1.0
LAST_DECISION_TIMEOUT_S = 2.0
TURN_S = 0.02


def run_multi_process(run: Run) -> None:
    """Run the graph until goal or time limit; the bag is closed and complete afterwards.

    Raises GraphError for a node that ends or does not get ready, StoppedError for an attempt that
    is stopped from outside: then the bag holds what happened until then. Raises BagError when
    the recorder missed something.
    """
    run.console.log_to(run.directory.log)
    config = run.request.config
    told = graph_parameters(config, (*NODES, RECORDER))
    bag = str(run.directory.bag.absolute())
    # First, as what it hears first it must not miss.
    told = {RECORDER: recorder_parameters(config, bag, told)} | told
    with (
        private_domain() as domain,
        Monitor(domain, config.scenario.robot_names or (NO_NAMESPACE,)) as monitor,
        NodeProcesses(run.console.line, run.stop.is_urgent) as node_processes,
    ):
        run.console.say(f"starting the nodes; look on with ROS_DOMAIN_ID={domain}")
        node_processes.start(told, run.request.node_args)
        ticks = _MultiProcessDriver(run, monitor, node_processes, list(told)).run_motion()
    if not config.real_time:
        require_complete(run.directory, ticks)


class _MultiProcessDriver:
    """Lets the nodes get ready, play and stop together."""

    def __init__(
        self, run: Run, monitor: Monitor, node_processes: NodeProcesses, nodes: Sequence[str]
    ) -> None:
        self._run = run
        self._monitor = monitor
        self._node_processes = node_processes
        self._nodes = nodes
        robots = len(run.request.config.scenario.robots)
        self._patience_s = READY_TIMEOUT_S + MORE_PER_ROBOT_S * robots

    def run_motion(self) -> dict[str, int]:
        """Run from start to end; return each robot's number of ticks."""
        self._get_ready()
        self._monitor.listen()
        self._run.begin()
        try:
            self._let_go()
            ticks = self._watch()
        except (GraphError, StoppedError):
            self._freeze()
            raise
        self._run.end()
        self._hear_the_last_decision(ticks)
        return ticks

    def _check(self) -> None:
        self._node_processes.check()
        self._run.stop.check()

    def _wait(self, done: Callable[[], Any], timeout_s: float, explain: Callable[[], str]) -> None:
        """Spin until done; GraphError with the explanation after timeout_s."""
        deadline = time.monotonic() + timeout_s
        while not done():
            self._check()
            if time.monotonic() > deadline:
                raise GraphError(f"{explain()} after {timeout_s:g} s; see the nodes' lines above")
            self._monitor.spin(TURN_S)

    def _get_ready(self) -> None:
        """Wait until no node misses anything, so that no first message is lost."""
        questions = self._monitor.ask_ready(self._nodes)
        missing = dict.fromkeys(questions, "no answer yet")

        def all_ready() -> bool:
            for name in [*missing]:
                answer = questions[name].answer()
                if answer is not None:
                    missing[name] = answer.message
                    if answer.success:
                        del missing[name]
            return not missing

        self._wait(
            all_ready,
            self._patience_s,
            lambda: "not ready: " + "; ".join(f"{name}: {what}" for name, what in missing.items()),
        )
        self._node_processes.forget_parameters()

    def _let_go(self) -> None:
        question = self._monitor.ask_pause(False)
        self._wait(question.answer, ANSWER_TIMEOUT_S, lambda: "world_sim does not answer ~/pause")

    def _watch(self) -> dict[str, int]:
        """Until the world says that it is over; without waking up for every message."""
        tick_ns = self._run.request.config.planner.tick_ns
        while (ticks := self._monitor.ticks_at_end()) is None:
            self._check()
            time.sleep(TURN_S)
            self._monitor.take_in()
            if self._run.console.wants_progress() and (now := self._monitor.progress()):
                self._run.show(now.stamp_ns // tick_ns - 1, now.distance_m, now.mode)
        return ticks

    def _hear_the_last_decision(self, ticks: Mapping[str, int]) -> None:
        """In real time the world does not wait for the planner: give it a moment to finish."""
        tick_ns = self._run.request.config.planner.tick_ns
        deadline = time.monotonic() + LAST_DECISION_TIMEOUT_S
        while time.monotonic() < deadline:
            heard = self._monitor.stamps_ns()
            if all(heard.get(robot, 0) >= count * tick_ns for robot, count in ticks.items()):
                return
            self._check()
            self._monitor.spin(TURN_S)

    def _freeze(self) -> None:
        """Let the world stand still, if it lives, so that the bag ends with a whole tick."""
        question = self._monitor.ask_pause(True)
        deadline = time.monotonic() + FREEZE_TIMEOUT_S
        while question.answer() is None and time.monotonic() < deadline:
            if self._run.stop.is_urgent() or not self._node_processes.has(topics.WORLD_SIM):
                return
            self._monitor.spin(TURN_S)


def require_complete(directory: RunDirectory, ticks: Mapping[str, int]) -> None:
    """Raise BagError unless every topic of a robot's loop has a message for each of its ticks."""
    with BagReader(directory.bag) as reader:
        counts = {name: topic.message_count for name, topic in reader.topics.items()}
    every_tick = [topic for topic in topics.GRAPH if topic.every_tick]
    for robot, topic in itertools.product(ticks, every_tick):
        name = topic.name if topic.name.startswith("/") else below(robot, f"/{topic.name}")
        if (found := counts.get(name, 0)) < ticks[robot]:
            raise BagError(
                f"{directory.bag}: incomplete, {found} of {ticks[robot]} messages on {name}; "
                "run again on a machine with less to do"
            )
