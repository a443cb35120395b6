# SPDX-License-Identifier: Apache-2.0
"""Children that do not outlive their parent, not even its kill -9."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def end_with_parent(parent: int) -> None:
    """Let the system send this process SIGTERM when its parent ends (Linux).

    Called by the child itself: code between fork and exec is not safe once there are threads,
    and the wheels' re-exec comes first.
    """
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:
        prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it ended before that
        sys.exit(1)
