# SPDX-License-Identifier: Apache-2.0
"""What the tests of the launcher share: real processes, and who of them is still there."""

import os
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
# Thousands of ticks: long enough to be caught in the middle of it.
LONG = ["case1", "--planner", "paper", "--seed", "1", "--no-picture"]
LONG += ["--set", "planner.step_length_m=0.002"]


class Program:
    """One of our commands as a process, and all that descend from it."""

    def __init__(
        self,
        name: str,
        *args: str,
        cwd: Path,
        more_env: Mapping[str, str] | None = None,
        installed: bool = False,
    ) -> None:
        """With `installed` it is the executable that pip and colcon make, as `ros2 run` does."""
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
        for pid in self.family():
            with suppress(ProcessLookupError):  # it has ended by itself in between
                os.kill(pid, signal.SIGKILL)
        self.process.communicate()

    def send_group(self, sent: signal.Signals) -> None:
        """Signal the whole process group, as a terminal does at Ctrl-C."""
        os.killpg(self.process.pid, sent)

    def end(self, timeout_s: float = 60.0) -> int:
        """Wait for the end; keep what was said."""
        self.stdout, self.stderr = self.process.communicate(timeout=timeout_s)
        return self.process.returncode

    def family(self) -> list[int]:
        """Processes that run and carry our mark, the first one included."""
        return [pid for pid, environ in _environments() if f"{MARK}={self.mark}" in environ]

    def node(self, name: str) -> int:
        """The process of a node, NAMESPACE/node in a fleet."""
        namespace, _, program = name.rpartition("/")
        told = [f"entry.{program}()", f"__ns:=/{namespace}\0" if namespace else ""]
        found = [
            pid for pid in self.family() if all(words in _read(pid, "cmdline") for words in told)
        ]
        assert len(found) == 1, f"{name}: {found}"
        return found[0]

    def wait_for_data(self, run: Path) -> None:
        """Wait until the run goes on and a first chunk of it is in the bag."""
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
    """Let a command run to its end."""
    with Program(name, *args, cwd=cwd, more_env=more_env) as program:
        program.end()
        assert program.family() == []
        return program
