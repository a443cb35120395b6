# SPDX-License-Identifier: Apache-2.0
"""Helper: runs the package's programs as real processes and lists those still running."""

import os
import re
import signal
import subprocess
import sys
import uuid
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from project import ROOT
from waiting import wait_until

MARK = "MFBA_TEST_MARK"
INSTALLED = Path(sys.executable).parent
PROGRAM = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.{}())"
# Thousands of ticks: long enough for a test to interrupt it.
LONG = ["case1", "--planner", "paper", "--seed", "1", "--no-picture"]
LONG += ["--set", "planner.step_length_m=0.002"]


class Program:
    """One program of the package as a process, with all its descendants."""

    def __init__(
        self,
        name: str,
        *args: str,
        cwd: Path,
        more_env: Mapping[str, str] | None = None,
        installed: bool = False,
    ) -> None:
        """Start it; `installed` uses the executable of pip and colcon, as `ros2 run` does."""
        self.mark = uuid.uuid4().hex
        env = {**os.environ, MARK: self.mark, "PYTHONPATH": str(ROOT), **(more_env or {})}
        self.process = subprocess.Popen(
            [*([INSTALLED / name] if installed else _by_entry(name)), *args],
            cwd=cwd,
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # a process group of its own, as a shell gives it
        )
        self.stdout = self.stderr = ""

    def __enter__(self) -> "Program":
        return self

    def __exit__(self, *_: object) -> None:
        for pid in self.processes():
            with suppress(ProcessLookupError):  # it has ended in the meantime
                os.kill(pid, signal.SIGKILL)
        self.process.communicate()

    def wait_for_signal_handlers(self) -> None:
        """Wait until SIGTERM has a handler, which Python itself never gives it: the program's."""

        def handled() -> bool:
            status = _read(self.process.pid, "status")
            caught = re.search(r"^SigCgt:\s*(\w+)", status, re.MULTILINE)
            is_set = caught and int(caught[1], 16) >> (signal.SIGTERM - 1) & 1
            return bool(is_set) or self.process.poll() is not None

        wait_until(handled, timeout_s=60.0)

    def send_group(self, sent: signal.Signals) -> None:
        """Signal the whole process group, as a terminal does at Ctrl-C."""
        os.killpg(self.process.pid, sent)

    def end(self, timeout_s: float = 60.0) -> int:
        """Wait for the end, keep stdout and stderr; return the exit code."""
        self.stdout, self.stderr = self.process.communicate(timeout=timeout_s)
        return self.process.returncode

    def processes(self) -> list[int]:
        """PIDs of running processes with this program's mark, including the first one."""
        return [pid for pid, environ in _environments() if f"{MARK}={self.mark}" in environ]

    def node(self, name: str) -> int:
        """The PID of a node, NODE or NAMESPACE/NODE."""
        namespace, _, program = name.rpartition("/")
        required = [f"__ns:=/{namespace}"] if namespace else []
        found = []
        for pid in self.processes():
            words = _read(pid, "cmdline").rstrip("\0").split("\0")
            if words[0] == program and all(word in words for word in required):
                found.append(pid)
        assert len(found) == 1, f"{name}: {found}"
        return found[0]

    def wait_for_data(self, run: Path) -> None:
        """Wait until the bag has a first chunk of the run."""
        bag = run / "bag" / "bag_0.mcap"
        wait_until(lambda: bag.exists() and bag.stat().st_size > 30_000, timeout_s=60.0)


def _by_entry(name: str) -> list[str]:
    return [sys.executable, "-c", PROGRAM.format(name)]


def _environments() -> list[tuple[int, list[str]]]:
    pids = [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]
    return [(pid, _read(pid, "environ").split("\0")) for pid in pids]


def _read(pid: int, what: str) -> str:
    try:
        return Path(f"/proc/{pid}/{what}").read_text(encoding="utf-8", errors="replace")
    except OSError:  # it has ended
        return ""


def complete(name: str, *args: str, cwd: Path, **more_env: str) -> Program:
    """Run a command to its end."""
    with Program(name, *args, cwd=cwd, more_env=more_env) as program:
        program.end()
        assert program.processes() == []
        return program
