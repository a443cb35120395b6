# SPDX-License-Identifier: Apache-2.0
"""What several test files share: waiting for facts, and domains nobody else uses."""

import itertools
import os
import socket
import time
from collections.abc import Callable
from typing import Any

# Domains above 101 map to ports that Linux hands out to any program. Each process starts
# elsewhere and goes round, so that a domain rests after use.
_DOMAINS = range(1, 102)
_candidates = itertools.islice(itertools.cycle(_DOMAINS), os.getpid() % len(_DOMAINS), None)


def claim_domain() -> tuple[int, socket.socket]:
    """Return a ROS domain id no other test process holds, and the lock to close after use."""
    for domain in itertools.islice(_candidates, len(_DOMAINS)):
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lock.bind(f"\0mfba_planner_test_domain_{domain}")
        except OSError:
            lock.close()
        else:
            return domain, lock
    raise AssertionError(f"all {len(_DOMAINS)} ROS domains are taken; end other test runs")


def spin_until(executor: Any, condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
    """Spin the executor until the condition holds; AssertionError after timeout_s."""
    _until(condition, timeout_s, lambda: executor.spin_once(timeout_sec=0.02))


def wait_until(condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
    """Wait for a fact that no executor brings: a file, a process; AssertionError likewise."""
    _until(condition, timeout_s, lambda: time.sleep(0.005))


def _until(condition: Callable[[], bool], timeout_s: float, turn: Callable[[], None]) -> None:
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"not so after {timeout_s} s: {condition}"
        turn()
