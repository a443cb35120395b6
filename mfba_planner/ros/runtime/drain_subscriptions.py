# SPDX-License-Identifier: Apache-2.0
"""Keep receiving before the end: messages may be in transit, and senders may be far ahead."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.executors import Executor

QUIET_S = 0.2  # on one machine a message takes a hundredth of that, unless it is overloaded
LIVE_S = 1.0  # from then on, IDLE_SPINS without a message are enough (one may be a timer's)
IDLE_SPINS = 5
LONGEST_S = 10.0


def drain(executor: Executor, count: Callable[[], int]) -> None:
    """Spin until no message came for QUIET_S; count returns how many were received.

    Where senders never end, as on a live robot, until what was waiting has been received.
    """
    started_s = received_s = time.monotonic()
    before, idle = count(), 0
    while idle < IDLE_SPINS:
        now = time.monotonic()
        if now > min(received_s + QUIET_S, started_s + LONGEST_S):
            return
        is_live = now > started_s + LIVE_S
        executor.spin_once(timeout_sec=0.0 if is_live else QUIET_S)
        idle += is_live
        if count() != before:
            before, idle, received_s = count(), 0, time.monotonic()
