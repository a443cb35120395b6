# SPDX-License-Identifier: Apache-2.0
"""What several test files share: waiting for facts, and domains nobody else uses."""

import time
from collections.abc import Callable
from typing import Any

# The launcher's own: tests and runs must not meet in a domain.
from mfba_planner.launcher.ros_domain import claim_domain as claim_domain


def spin_until(executor: Any, condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Spin the executor until the condition holds; AssertionError after timeout_s."""
    _until(condition, timeout_s, lambda: executor.spin_once(timeout_sec=0.02))


def wait_until(condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Wait for a fact that no executor brings: a file, a process; AssertionError likewise."""
    _until(condition, timeout_s, lambda: time.sleep(0.005))


def _until(condition: Callable[[], bool], timeout_s: float, turn: Callable[[], None]) -> None:
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"not so after {timeout_s} s: {condition}"
        turn()
