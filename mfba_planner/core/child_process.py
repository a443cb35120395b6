# SPDX-License-Identifier: Apache-2.0
"""Child processes: one that ends with its parent, even after SIGKILL; its name for ps."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_PR_SET_NAME = 15


def end_with_parent(parent: int) -> None:
    """Let Linux send this process SIGTERM when its parent ends; exit if it has ended already.

    The child calls this itself: code between fork and exec is not safe in a process with threads,
    and the re-exec for the wheels' libraries comes first.
    """
    _prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # the parent ended before prctl
        sys.exit(1)


def set_command_line(words: Sequence[str]) -> None:
    """Show words as this process's command line in ps and /proc, cut to the present one's length.

    For a process made by fork alone, which otherwise shows its parent's. No effect where Linux
    does not tell the place of the command line (proc_pid_stat(5): arg_start, arg_end).
    """
    _prctl(_PR_SET_NAME, words[0].encode())  # Linux takes 15 bytes of it
    after_name = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    start, end = int(after_name[45]), int(after_name[46])
    room = end - start
    if start > 0 and room > 1:
        text = "\0".join(words).encode()[: room - 1]
        ctypes.memmove(start, text.ljust(room, b"\0"), room)


def _prctl(option: int, value: int | bytes) -> None:
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:
        prctl(option, value)
