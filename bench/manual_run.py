# SPDX-License-Identifier: Apache-2.0
"""A recorded run with a process per node, started step by step: for benches that disturb it."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

from mfba_planner.launcher.forked_process import ForkServer
from mfba_planner.launcher.graph_monitor import GraphMonitor
from mfba_planner.launcher.node_processes import NodeProcesses
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.ros.interface import topics
from mfba_planner.scenarios.run_config import (
    NODES,
    RunConfig,
    node_parameters,
    recorder_parameters,
)

TIMEOUT_S = 180.0
ALL = (topics.RECORDER, *NODES)


class ManualRun:
    """The nodes of one run in a domain of their own; all of them end with the context."""

    def __init__(self, config: RunConfig, bag: Path, **world: Any) -> None:
        """Prepare; world holds further parameters of world_sim."""
        self.parameters = node_parameters(config, ALL)
        self.parameters[topics.WORLD_SIM] |= world
        self.parameters[topics.RECORDER] = recorder_parameters(config, str(bag), NODES)
        self._tick_ns = config.planner.tick_ns
        self._lines: list[str] = []
        self._stack = ExitStack()

    def __enter__(self) -> ManualRun:
        self.domain = self._stack.enter_context(private_domain())
        self.monitor = self._stack.enter_context(GraphMonitor(self.domain))
        keep_line = lambda name, line: self._lines.append(f"{name}: {line}")  # noqa: E731
        server = self._stack.enter_context(ForkServer())
        self.processes = self._stack.enter_context(NodeProcesses(server, keep_line, lambda: False))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def until(self, done: Callable[[], Any], what: str) -> None:
        """Spin until done; AssertionError with the nodes' last lines after TIMEOUT_S."""
        deadline = time.monotonic() + TIMEOUT_S
        while not done():
            if time.monotonic() > deadline:
                raise AssertionError(f"{what}: never\n" + "\n".join(self._lines[-20:]))
            self.monitor.spin(0.01)

    def wait(self, delay_s: float) -> None:
        """Spin for so long."""
        due = time.monotonic() + delay_s
        self.until(lambda: time.monotonic() >= due, "delay")

    def start(self, names: Sequence[str] = ALL, delays_s: Sequence[float] = ()) -> None:
        """Start the nodes in this sequence, each after a delay; then end the pause."""
        for name, delay_s in zip(names, [*delays_s, *[0.0] * len(names)]):
            self.wait(delay_s)
            self.processes.start({name: self.parameters[name]}, {})
        for name, question in self.monitor.call_ready(ALL).items():
            ready = lambda q=question: (a := q.response()) is not None and a.success  # noqa: E731
            self.until(ready, f"{name} ready")
        self.monitor.subscribe()
        self.until(self.monitor.call_pause(False).response, "pause")

    def tick(self) -> int:
        """The last tick that was decided, -1 before the first."""
        self.monitor.poll()
        now = self.monitor.progress()
        return now.stamp_ns // self._tick_ns - 1 if now else -1

    def end(self) -> None:
        """Wait until world_sim reports the end of the run."""
        self.until(self.monitor.ticks_at_end, "end of the run")

    def replace_planner(self) -> None:
        """Kill the planner with -9 and start another."""
        (planner,) = [child for child in self.processes.children if child.name == topics.PLANNER]
        planner.send_signal(signal.SIGKILL)
        planner.wait_for_exit(TIMEOUT_S)
        self.processes.children.remove(planner)
        self.processes.start(
            {topics.PLANNER: self.parameters[topics.PLANNER] | {"wait_for": ""}}, {}
        )
