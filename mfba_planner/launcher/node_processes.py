# SPDX-License-Identifier: Apache-2.0
"""All nodes of a run: parameters handed out, deaths noticed, and nobody left behind."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from signal import SIGKILL, SIGTERM
from typing import Any

import yaml

from ..core.errors import GraphError
from ..scenarios.run_config import Parameters
from .node_process import NodeProcess

RECORDER_GRACE_S = 20.0  # it still writes what it has received
GRACE_S = 10.0  # on a machine with far too much to do; a killed node counts as a failure
MORE_EACH_S = 1.0  # they end all at once, and each hears of each


class NodeProcesses:
    """The nodes' processes, as a context: whatever happens inside, all of them end with it."""

    def __init__(self, sink: Callable[[str, str], None], hurry: Callable[[], bool]) -> None:
        """Send output to sink; hurry says that nobody wants to wait for orderly ends."""
        self.children: list[NodeProcess] = []
        self._sink = sink
        self._hurry = hurry
        self._files = tempfile.TemporaryDirectory(prefix="mfba_")

    def __enter__(self) -> NodeProcesses:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        stopped = self.children
        self.stop()
        failed = [child for child in stopped if child.process.returncode != 0]
        if failed and kind is None:
            raise GraphError(_death_message(failed[0]))

    def start(self, told: Parameters, more: Mapping[str, list[str]]) -> None:
        """Start a node per entry of told, in that order; more holds further --ros-args.

        NAMESPACE/planner is a planner in a namespace; what planner is told further, it is told.
        """
        for name, parameters in told.items():
            path = Path(self._files.name) / f"{name.replace('/', '.')}.yaml"
            path.write_text(parameters_yaml(parameters), encoding="utf-8")
            args = ["--ros-args", "--disable-external-lib-logs", "--params-file", str(path)]
            args += more.get(name.rpartition("/")[2], [])
            self.children.append(NodeProcess(name, args, self._sink))

    def forget_parameters(self) -> None:
        """Remove the parameter files: every node has read its own."""
        self._files.cleanup()

    def has(self, name: str) -> bool:
        """Whether a node of that name runs."""
        return any(child.is_alive for child in self.children if child.name == name)

    def check(self) -> None:
        """Raise GraphError for a node that has ended, with what it said last."""
        for child in self.children:
            if not child.is_alive:
                child.ended_within(1.0)  # now, but for its last lines
                raise GraphError(_death_message(child))

    def stop(self) -> None:
        """End all: the recorder first, while those it hears are there, then the others."""
        children, self.children = self.children, []
        recorders = [child for child in children if child.name == "recorder"]
        self._end(recorders, RECORDER_GRACE_S)
        others = [child for child in children if child not in recorders]
        self._end(others, GRACE_S + MORE_EACH_S * len(others))
        self._files.cleanup()

    def _end(self, children: list[NodeProcess], grace_s: float) -> None:
        for child in children:
            child.tell(SIGTERM)
        deadline = time.monotonic() + grace_s
        while not all(child.ended_within(0.05) for child in children):
            if self._hurry() or time.monotonic() > deadline:
                for child in children:
                    child.tell(SIGKILL)
                deadline += grace_s


def parameters_yaml(parameters: Mapping[str, Any]) -> str:
    """A --params-file for whatever name the node has; floats keep their point."""
    content = {"/**": {"ros__parameters": dict(parameters)}}
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=2**31)


def _death_message(child: NodeProcess) -> str:
    said = [line for line in child.last_lines if line]
    # A node that refuses something says it in its last line.
    last = f"; it said last: {said[-1]}" if said else " without a word"
    return f"{child.name} ended ({child.how_it_ended()}){last}"
