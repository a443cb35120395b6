# SPDX-License-Identifier: Apache-2.0
"""Programs for a fork server's processes that start faster than nodes."""

import inspect
import os
import signal
import sys
from contextlib import suppress


def prints() -> int:
    print("one")
    print("two", end="", flush=True)
    return 3


def prints_bytes() -> int:
    sys.stdout.buffer.write(b"\xff\xfe ok\n")
    return 0


def ignores_sigterm() -> int:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    return waits()


def waits() -> int:
    print("up", flush=True)
    signal.pause()
    return 0


def knows_all_files() -> int:
    """Whether nothing is left to look for when rclpy logs a node's first line."""
    names = [name for name in sys.modules if name.startswith("mfba_planner.ros.nodes.")]
    known = set(inspect.modulesbyfile.values())  # type: ignore[attr-defined]
    print(len(names) >= 4 and known.issuperset(names), flush=True)
    return 0


def raises() -> int:
    raise RuntimeError("a bug")


def describes_itself() -> int:
    """Session, parent, arguments, an environment variable, open files beyond the usual three."""
    print(os.getsid(0) == os.getpid(), os.getppid(), sys.argv, os.environ.get("MFBA_TEST_NEW"))
    files = []
    for fd in os.listdir("/proc/self/fd"):
        with suppress(FileNotFoundError):  # the directory itself
            files.append(os.readlink(f"/proc/self/fd/{fd}"))
    print(sorted(files))
    return 0
