# SPDX-License-Identifier: Apache-2.0
"""All node processes of a run: parameter files, start, check that they run, stop."""

from __future__ import annotations

import os
import signal
import tempfile
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from signal import SIGKILL, SIGTERM
from threading import Thread
from typing import Any

import yaml

from ..core.errors import GraphError
from ..core.ros_arguments import NO_PARAMETER_SERVICES
from ..scenarios.run_config import Parameters
from .forked_process import ForkServer

RECORDER_GRACE_S = 20.0  # it first writes what it has received
GRACE_S = 10.0  # enough on an overloaded machine; a killed node counts as a failure
MORE_EACH_S = 1.0  # all end at once, and DDS notifies each node of the others' end
LAST_LINES = 8

# No client calls it, each service makes every spin of an executor slower, and every node of the
# graph has to be told of it.
NO_EXTRA_SERVICES = {"start_type_description_service": False}


PROGRAM = "mfba_planner.entry_points:{}"


class NodeProcess:
    """A running node; its output goes to sink(name, line), line by line."""

    def __init__(
        self, server: ForkServer, name: str, args: list[str], sink: Callable[[str, str], None]
    ) -> None:
        """Start a program of entry_points.py; name is PROGRAM or NAMESPACE/PROGRAM."""
        namespace, _, program = name.rpartition("/")
        if namespace:
            args = [*args, "-r", f"__ns:=/{namespace}"]
        self.name = name
        self.last_lines: deque[str] = deque(maxlen=LAST_LINES)
        output, write_end = os.pipe()
        try:
            self._process = server.start(PROGRAM.format(program), args, [program], write_end)
        finally:
            os.close(write_end)
        self._reader = Thread(target=self._read_output, args=(output, sink), daemon=True)
        self._reader.start()

    def _read_output(self, output: int, sink: Callable[[str, str], None]) -> None:
        with open(output, "rb") as pipe:
            for raw in pipe:
                line = raw.decode("utf-8", "replace").rstrip()
                self.last_lines.append(line)
                sink(self.name, line)

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code, negative for a signal; None while the process runs."""
        return self._process.wait()

    def describe_exit(self) -> str:
        """Exit code or signal, as text."""
        code = self.exit_code
        if code is None:
            return "still running"
        if code >= 0:
            return f"exit code {code}"
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"

    def send_signal(self, signum: signal.Signals) -> None:
        """Send a signal; no effect when the process has ended."""
        self._process.send_signal(signum)

    def wait_for_exit(self, timeout_s: float) -> bool:
        """Wait for the exit and for the last output; False after timeout_s."""
        if self._process.wait(timeout_s) is None:
            return False
        self._reader.join(1.0)  # a process it started may still hold the pipe
        return True


class NodeProcesses:
    """The node processes, as a context manager: all of them end with it, after errors too."""

    def __init__(
        self,
        server: ForkServer,
        sink: Callable[[str, str], None],
        kill_at_once: Callable[[], bool],
    ) -> None:
        """Send output to sink; when kill_at_once() is true, stop() kills without waiting."""
        self._server = server
        self.children: list[NodeProcess] = []
        self._sink = sink
        self._kill_at_once = kill_at_once
        self._files = tempfile.TemporaryDirectory(prefix="mfba_")

    def __enter__(self) -> NodeProcesses:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        stopped = self.children
        self.stop()
        failed = [child for child in stopped if child.exit_code != 0]
        if failed and kind is None:
            raise GraphError(_exit_message(failed[0]))

    def start(self, parameters: Parameters, extra_args: Mapping[str, list[str]]) -> None:
        """Start a node per entry of parameters, one after the other.

        Names are NODE or NAMESPACE/NODE. extra_args holds more --ros-args by NODE, for all
        namespaces. The nodes of a fleet have no services for parameters and the life cycle.
        """
        own = [NO_PARAMETER_SERVICES] if any("/" in name for name in parameters) else []
        for name, values in parameters.items():
            path = Path(self._files.name) / f"{name.replace('/', '.')}.yaml"
            path.write_text(parameters_yaml({**values, **NO_EXTRA_SERVICES}), encoding="utf-8")
            args = [*own, "--ros-args", "--disable-external-lib-logs", "--params-file", str(path)]
            args += extra_args.get(name.rpartition("/")[2], [])
            self.children.append(NodeProcess(self._server, name, args, self._sink))

    def remove_parameter_files(self) -> None:
        """Remove the parameter files; call it when every node has read its own."""
        self._files.cleanup()

    def is_running(self, name: str) -> bool:
        """Whether a node of that name runs."""
        return any(child.exit_code is None for child in self.children if child.name == name)

    def check(self) -> None:
        """Raise GraphError for a node that has ended, with its last line of output."""
        for child in self.children:
            if child.exit_code is not None:
                child.wait_for_exit(1.0)  # it has ended: this reads its last lines
                raise GraphError(_exit_message(child))

    def stop(self) -> None:
        """End all: the recorder first, while its publishers still run, then the others."""
        children, self.children = self.children, []
        recorders = [child for child in children if child.name == "recorder"]
        self._end(recorders, RECORDER_GRACE_S)
        others = [child for child in children if child not in recorders]
        self._end(others, GRACE_S + MORE_EACH_S * len(others))
        self._files.cleanup()

    def _end(self, children: list[NodeProcess], grace_s: float) -> None:
        for child in children:
            child.send_signal(SIGTERM)
        deadline = time.monotonic() + grace_s
        while not all(child.wait_for_exit(0.05) for child in children):
            if self._kill_at_once() or time.monotonic() > deadline:
                for child in children:
                    child.send_signal(SIGKILL)
                deadline += grace_s


def parameters_yaml(values: Mapping[str, Any]) -> str:
    """The text of a --params-file for any node name; floats keep their point.

    Raises UnicodeEncodeError for text with bytes that are not UTF-8: rcl reads no other file.
    """
    for value in values.values():
        if isinstance(value, str):
            value.encode("utf-8")
    content = {"/**": {"ros__parameters": dict(values)}}
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=2**31)


def _exit_message(child: NodeProcess) -> str:
    lines = [line for line in child.last_lines if line]
    # A node that refuses its arguments prints the reason in its last line.
    last = f"; last line: {lines[-1]}" if lines else " without output"
    return f"{child.name} ended ({child.describe_exit()}){last}"
