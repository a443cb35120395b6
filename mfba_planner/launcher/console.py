# SPDX-License-Identifier: Apache-2.0
"""Console output of a run: the nodes' lines with their names, and the progress line."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import IO, Any

PLAIN_PERIOD_S = 2.0  # between two lines of progress where a line cannot be overwritten
LIVE_PERIOD_S = 0.1


class RunConsole:
    """Standard output, and a log file after log_to.

    On a terminal, progress is one line that is overwritten; otherwise a line every 2 s.
    """

    def __init__(self) -> None:
        """Choose the form of progress by what standard output is."""
        self._lock = Lock()
        self._log: IO[str] | None = None
        self._live: Any = None
        self._shown_at = time.monotonic()
        self._period_s = LIVE_PERIOD_S if sys.stdout.isatty() else PLAIN_PERIOD_S

    def log_to(self, path: Path) -> None:
        """Write the nodes' lines into a new file as well."""
        self._log = open(path, "x", encoding="utf-8")  # noqa: SIM115  (close() closes it)

    def close(self) -> None:
        """End the progress line and the log file."""
        with self._lock:
            if self._live is not None:
                self._live.stop()
                self._live = None
            if self._log is not None:
                with suppress(OSError):
                    self._log.close()
                self._log = None

    def print_node_line(self, node: str, text: str) -> None:
        """Print a node's line, whole; may be called from any thread."""
        line = f"[{node}] {text}"
        with self._lock, suppress(OSError):  # a full disk or a closed pipe must not end a node
            if self._log is not None:
                self._log.write(f"{line}\n")
                self._log.flush()
            self._print(line)

    def print_line(self, text: str) -> None:
        """Print a line of the launcher."""
        with self._lock:
            self._print(text)

    def is_progress_due(self) -> bool:
        """Whether the next progress line is due."""
        return time.monotonic() - self._shown_at >= self._period_s

    def show_progress(self, text: str) -> None:
        """Print the progress line."""
        self._shown_at = time.monotonic()
        with self._lock:
            if self._period_s == PLAIN_PERIOD_S:
                self._print(text)
                return
            if self._live is None:
                self._live = _live_line()
            self._live.update(_plain(text), refresh=True)

    def _print(self, line: str) -> None:
        if self._live is not None:
            self._live.console.print(_plain(line), soft_wrap=True)
        else:
            encoding = sys.stdout.encoding or "utf-8"
            sys.stdout.write(f"{line}\n".encode(encoding, "replace").decode(encoding))
            sys.stdout.flush()


def _live_line() -> Any:
    from rich.live import Live

    live = Live(auto_refresh=False, transient=True)
    live.start()
    return live


def _plain(text: str) -> Any:
    """Text without rich's markup."""
    from rich.text import Text

    return Text(text)
