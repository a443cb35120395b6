# SPDX-License-Identifier: Apache-2.0
"""Keep receiving before the end: messages may be in transit, and senders may be far ahead."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.executors import Executor

QUIET_S = 0.2  # on one machine a message takes a hundredth of that, unless it is overloaded
QUIET_SPINS = 8  # without a message: a process that hardly runs receives nothing either
BEHIND_S = 1.0  # instead of QUIET_S, while messages are known to be missing
LIVE_S = 1.0  # from then on, IDLE_SPINS without a message are enough (one may be a timer's)
IDLE_SPINS = 25
LONGEST_S = 10.0


def drain(
    executor: Executor, count: Callable[[], int], is_behind: Callable[[], bool] = lambda: False
) -> None:
    """Spin until no message came for QUIET_S and QUIET_SPINS, or for BEHIND_S while is_behind().

    count tells how many came. Where senders never end, as on a live robot, it ends when what was
    waiting has been received.
    """
    started_s = received_s = time.monotonic()
    before, idle, quiet = count(), 0, 0
    while idle < IDLE_SPINS:
        now = time.monotonic()
        quiet_s = now - received_s
        is_quiet = quiet_s > QUIET_S and quiet >= QUIET_SPINS
        if (is_quiet and (quiet_s > BEHIND_S or not is_behind())) or now > started_s + LONGEST_S:
            return
        is_live = now > started_s + LIVE_S + (BEHIND_S if is_behind() else 0.0)
        executor.spin_once(timeout_sec=0.0 if is_live else QUIET_S / QUIET_SPINS)
        idle, quiet = idle + is_live, quiet + 1
        if count() != before:
            before, idle, quiet, received_s = count(), 0, 0, time.monotonic()
