# SPDX-License-Identifier: Apache-2.0
"""Receive on before the end: what was sent is on its way, and senders may be far ahead."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.executors import Executor

QUIET_S = 0.2  # on one machine a message takes a hundredth of that, unless it is overloaded
LIVE_S = 1.0  # from then on, IDLE_TURNS without a message are enough (one may be a timer's)
IDLE_TURNS = 5
LONGEST_S = 10.0


def drain(executor: Executor, count: Callable[[], int]) -> None:
    """Spin until nothing has come for a while; count says how many messages have come.

    Where senders never end, as on a live robot, until what was waiting has been received.
    """
    started = heard = time.monotonic()
    before, idle = count(), 0
    while idle < IDLE_TURNS:
        now = time.monotonic()
        if now > min(heard + QUIET_S, started + LONGEST_S):
            return
        is_live = now > started + LIVE_S
        executor.spin_once(timeout_sec=0.0 if is_live else QUIET_S)
        idle += is_live
        if count() != before:
            before, idle, heard = count(), 0, time.monotonic()
