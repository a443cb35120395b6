# SPDX-License-Identifier: Apache-2.0
"""Waiting for a condition, and ROS domains that no other test uses."""

import time
from collections.abc import Callable
from typing import Any

# The launcher's own: tests and runs must not meet in a domain.
from mfba_planner.launcher.ros_domain import claim_domain as claim_domain


def spin_until(executor: Any, condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Spin the executor until the condition holds; AssertionError after timeout_s."""
    _until(condition, timeout_s, lambda: executor.spin_once(timeout_sec=0.02))


def wait_until(condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Wait for a condition without an executor (a file, a process); AssertionError likewise."""
    _until(condition, timeout_s, lambda: time.sleep(0.005))


def _until(condition: Callable[[], bool], timeout_s: float, step: Callable[[], None]) -> None:
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"not true after {timeout_s} s: {condition}"
        step()
