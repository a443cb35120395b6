# SPDX-License-Identifier: Apache-2.0
"""One node as a process of its own: started, listened to, stopped for certain."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from threading import Thread

LAST_LINES = 8

# As multiprocessing does it: the child searches where the launcher does, so a checkout, a pip
# and a colcon installation all work, from any directory.
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
    "RCUTILS_LOGGING_BUFFERED_STREAM": "1",  # by lines, or the last ones die with the node
    # While nodes still find each other answers get lost; we ask again until one comes.
    "PYTHONWARNINGS": "ignore:failed to send response:RuntimeWarning",
}


class NodeProcess:
    """A running node; its output goes to sink(name, line), line by line."""

    def __init__(self, name: str, args: list[str], sink: Callable[[str, str], None]) -> None:
        """Start a program of entry_points.py with args; name is its own, or NAMESPACE/its own."""
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
            # A Ctrl-C must reach the launcher only, which then ends its children in order.
            start_new_session=True,
        )
        self._listener = Thread(target=self._listen, args=(sink,), daemon=True)
        self._listener.start()

    def _listen(self, sink: Callable[[str, str], None]) -> None:
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

    def how_it_ended(self) -> str:
        """How the process ended, in words."""
        code = self.process.poll()
        if code is None:
            return "still running"
        if code >= 0:
            return f"exit code {code}"
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"

    def tell(self, signum: signal.Signals) -> None:
        """Send a signal; nothing when it has ended."""
        self.process.send_signal(signum)  # knows about processes that have ended

    def ended_within(self, timeout_s: float) -> bool:
        """Wait for the end, and for the last of its output."""
        try:
            self.process.wait(max(0.0, timeout_s))
        except subprocess.TimeoutExpired:
            return False
        self._listener.join(1.0)  # a process it started may still hold the pipe
        return True
