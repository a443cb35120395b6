# SPDX-License-Identifier: Apache-2.0
"""A child process that ends with its parent, even if the parent is killed with SIGKILL."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def end_with_parent(parent: int) -> None:
    """Let Linux send this process SIGTERM when its parent ends; exit if it has ended already.

    The child calls this itself: code between fork and exec is not safe in a process with threads,
    and the re-exec for the wheels' libraries comes first.
    """
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:
        prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # the parent ended before prctl
        sys.exit(1)
