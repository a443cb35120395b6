# SPDX-License-Identifier: Apache-2.0
"""On import: checks that ROS 2 can start; ConfigError, with the remedy, if not."""

import ctypes
import os

from ..core.broken_library import explain_broken_library
from ..core.errors import ConfigError
from .log_directory import choose_log_directory
from .shared_memory import require_shared_memory

# With any other value rcutils prints an error for every line that a node logs.
_LOG_SWITCHES = (
    "RCUTILS_LOGGING_USE_STDOUT",
    "RCUTILS_LOGGING_BUFFERED_STREAM",
    "RCUTILS_COLORIZED_OUTPUT",
)


def _require_ros() -> None:
    """Raise ConfigError, with the remedy, where rclpy or its middleware cannot work."""
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not (domain.isdecimal() and int(domain) <= 232):
        raise ConfigError(f"ROS_DOMAIN_ID={domain}: no such domain; give 0 to 232 or unset it")
    for switch in _LOG_SWITCHES:
        if (value := os.environ.get(switch) or "0") not in ("0", "1"):
            raise ConfigError(f"{switch}={value}: neither 0 nor 1; give one of them or unset it")
    choose_log_directory()
    require_shared_memory()
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
    except Exception as error:
        reason = f"rclpy: {str(error).partition(chr(10))[0]}"
        if not isinstance(error, ImportError):
            reason = explain_broken_library(error) or reason
        distribution = os.environ.get("ROS_DISTRO", "jazzy")
        if distribution != "jazzy":
            reason += f" (ROS_DISTRO={distribution}, and this package is for jazzy)"
        raise ConfigError(
            f"{reason}; source a ROS 2 workspace or pip install -r requirements-ros.txt"
        ) from None


_require_ros()
