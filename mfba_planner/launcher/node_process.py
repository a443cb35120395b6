# SPDX-License-Identifier: Apache-2.0
"""One node as a child process: start, read its output, signal it, wait for its exit."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from threading import Thread

LAST_LINES = 8

# As multiprocessing does: the child gets the launcher's sys.path, so a checkout, a pip and a
# colcon installation all work, from any directory.
_BOOT = """\
import sys
sys.path[:] = {path!r}
from mfba_planner.core.child_process import end_with_parent
end_with_parent({parent})
from mfba_planner import entry_points
sys.exit(entry_points.{program}())
"""
_LOGGING = {
    "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{severity}: {message}",
    "RCUTILS_COLORIZED_OUTPUT": "0",
    "RCUTILS_LOGGING_BUFFERED_STREAM": "1",  # by lines, or a killed node loses its last ones
    # Responses get lost during discovery; graph_monitor sends the request again.
    "PYTHONWARNINGS": "ignore:failed to send response:RuntimeWarning",
}


class NodeProcess:
    """A running node; its output goes to sink(name, line), line by line."""

    def __init__(self, name: str, args: list[str], sink: Callable[[str, str], None]) -> None:
        """Start a program of entry_points.py; name is PROGRAM or NAMESPACE/PROGRAM."""
        namespace, _, program = name.rpartition("/")
        if namespace:
            args = [*args, "-r", f"__ns:=/{namespace}"]
        self.name = name
        self.last_lines: deque[str] = deque(maxlen=LAST_LINES)
        path = [entry or os.getcwd() for entry in sys.path]
        boot = _BOOT.format(path=path, parent=os.getpid(), program=program)
        self.process = subprocess.Popen(
            [sys.executable, "-c", boot, *args],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**_LOGGING, **os.environ},
            # Ctrl-C must reach the launcher only, which then ends the nodes: the recorder first.
            start_new_session=True,
        )
        self._reader = Thread(target=self._read_output, args=(sink,), daemon=True)
        self._reader.start()

    def _read_output(self, sink: Callable[[str, str], None]) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as pipe:
            for raw in pipe:
                line = raw.decode("utf-8", "replace").rstrip()
                self.last_lines.append(line)
                sink(self.name, line)

    @property
    def is_alive(self) -> bool:
        """Whether the process still runs."""
        return self.process.poll() is None

    def describe_exit(self) -> str:
        """Exit code or signal, as text."""
        code = self.process.poll()
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
        self.process.send_signal(signum)

    def wait_for_exit(self, timeout_s: float) -> bool:
        """Wait for the exit and for the last output; False after timeout_s."""
        try:
            self.process.wait(max(0.0, timeout_s))
        except subprocess.TimeoutExpired:
            return False
        self._reader.join(1.0)  # a process it started may still hold the pipe
        return True
