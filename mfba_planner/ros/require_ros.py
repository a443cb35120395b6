# SPDX-License-Identifier: Apache-2.0
"""On import: checks that ROS 2 can start; ConfigError, with the remedy, if not."""

import ctypes
import os

from ..core.errors import ConfigError


def _require_ros() -> None:
    """Raise ConfigError, with the remedy, where rclpy or its middleware cannot work."""
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not (domain.isdecimal() and int(domain) <= 232):
        raise ConfigError(f"ROS_DOMAIN_ID={domain}: no such domain; give 0 to 232 or unset it")
    name = os.environ.get("RMW_IMPLEMENTATION")
    try:
        if name:
            # rcl would exit with code 102 during its import.
            ctypes.CDLL(f"lib{name}.so")
    except OSError as error:
        raise ConfigError(
            f"RMW_IMPLEMENTATION={name}: {error}; unset it or install that middleware"
        ) from None
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        reason = str(error).partition("\n")[0]
        raise ConfigError(
            f"rclpy: {reason}; source a ROS 2 workspace or pip install -r requirements-ros.txt"
        ) from None


_require_ros()
