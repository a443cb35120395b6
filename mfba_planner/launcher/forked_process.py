# SPDX-License-Identifier: Apache-2.0
"""The launcher's side of the fork server: starts processes, signals them, gets exit codes."""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

from ..core.errors import GraphError
from .fork_server import MAX_BYTES

# As multiprocessing does: the child gets the launcher's sys.path, so a checkout, a pip and a
# colcon installation all work, from any directory.
_BOOT = """\
import sys
sys.path[:] = {path!r}
from mfba_planner.core.child_process import end_with_parent
end_with_parent({parent})
from mfba_planner.launcher import fork_server
fork_server.main({fd})
"""

_LOGGING = {
    "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{severity}: {message}",
    "RCUTILS_COLORIZED_OUTPUT": "0",
    "RCUTILS_LOGGING_BUFFERED_STREAM": "1",  # by lines, or a killed node loses its last ones
    # Responses get lost during discovery; graph_monitor sends the request again.
    "PYTHONWARNINGS": "ignore:failed to send response:RuntimeWarning",
}


class ForkServer:
    """A running fork server (fork_server.py), as a context manager; its processes end with it."""

    def __init__(self, *, at_once: bool = True) -> None:
        """Start the server; it imports what nodes need meanwhile. Without at_once start() does."""
        self._environment: dict[str, str] = {}
        self._exit_codes: dict[int, int] = {}
        self._process: subprocess.Popen[bytes] | None = None
        self.is_lost = False
        if at_once:
            self._process = self._start_server()

    def _start_server(self) -> subprocess.Popen[bytes]:
        self._connection, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._environment = {**_LOGGING, **os.environ}
        path = [entry or os.getcwd() for entry in sys.path]
        boot = _BOOT.format(path=path, parent=os.getpid(), fd=theirs.fileno())
        with theirs:
            return subprocess.Popen(
                [sys.executable, "-c", boot],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=self._environment,
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # a signal to the launcher's group must not end the nodes
            )

    def __enter__(self) -> ForkServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the server; processes that still run get SIGTERM. A second call has no effect."""
        if self._process is not None:
            self._connection.close()
            self._process.kill()  # it has nothing to write
            self._process.wait()
            self._process, self.is_lost = None, True

    def start(
        self, function: str, args: Sequence[str], title: Sequence[str], output: int
    ) -> ForkedProcess:
        """Run function ("MODULE:NAME", returns the exit code) with args as sys.argv[1:].

        The process has this process's environment and writes to the file descriptor output.
        Raises GraphError when the server has ended.
        """
        if self._process is None:
            self._process = self._start_server()
        environment = {**_LOGGING, **os.environ}
        names = environment.keys() | self._environment.keys()
        changed = {
            name: environment.get(name)
            for name in names
            if environment.get(name) != self._environment.get(name)
        }
        request = {
            "function": function,
            "args": list(args),
            "title": list(title),
            "environment": changed,
        }
        with suppress(BrokenPipeError):
            socket.send_fds(self._connection, [json.dumps(request).encode()], [output])
        while not self.is_lost:
            started = self._receive()
            if started is not None:
                return started
        code = self._process.wait()
        raise GraphError(f"the process that starts the nodes has ended (exit code {code})")

    def _receive(self) -> ForkedProcess | None:
        """Take one message: a process that was started, or an exit code."""
        data, fds = b"", list[int]()
        with suppress(ConnectionResetError):  # it has ended before it read a request
            data, fds, _, _ = socket.recv_fds(self._connection, MAX_BYTES, 1)
        if not data:
            self.is_lost = True
            return None
        message = json.loads(data)
        if "started" in message:
            return ForkedProcess(self, message["started"], fds[0])
        self._exit_codes[message["ended"]] = message["code"]
        return None

    def exit_code(self, pid: int, timeout_s: float) -> int | None:
        """The exit code of a process, negative for a signal; None: it still runs."""
        deadline = time.monotonic() + timeout_s
        while pid not in self._exit_codes and not self.is_lost:
            left_s = max(0.0, deadline - time.monotonic())
            if not select.select([self._connection], [], [], left_s)[0]:
                return None
            self._receive()
        return self._exit_codes.get(pid, -signal.SIGTERM)


class ForkedProcess:
    """A process that a ForkServer has started."""

    def __init__(self, server: ForkServer, pid: int, pidfd: int) -> None:
        """Take over pidfd."""
        self.pid = pid
        self._server, self._pidfd = server, pidfd
        self._exit_code: int | None = None

    def wait(self, timeout_s: float = 0.0) -> int | None:
        """Exit code, negative for a signal; None when it still runs after timeout_s."""
        if self._exit_code is None:
            self._exit_code = self._server.exit_code(self.pid, timeout_s)
            if self._exit_code is not None:
                if self._server.is_lost:  # it ends by the signal that its parent's end sends
                    select.select([self._pidfd], [], [])
                os.close(self._pidfd)
        return self._exit_code

    def send_signal(self, signum: signal.Signals) -> None:
        """Send a signal; no effect when the process has ended."""
        if self.wait() is None:
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._pidfd, signum)
