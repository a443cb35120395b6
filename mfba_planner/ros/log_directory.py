# SPDX-License-Identifier: Apache-2.0
"""Where ROS nodes write their log files: a directory that can be written, or they do not start."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from ..core.errors import ConfigError


def choose_log_directory() -> None:
    """Set ROS_LOG_DIR where the default directory cannot be written, and print so on stderr.

    The default is $ROS_HOME/log, ~/.ros/log. Raises ConfigError for a ROS_LOG_DIR that cannot be
    written: rclpy.init would raise.
    """
    given = os.environ.get("ROS_LOG_DIR")
    if given:
        reason = _why_not(Path(given).expanduser())
        if reason:
            raise ConfigError(
                f"ROS_LOG_DIR={given}: {reason}; give a directory that can be written, or unset it"
            )
        return
    default = _default()
    reason = _why_not(default) if default else "HOME is not set"
    if not reason:
        return
    other = Path(tempfile.gettempdir(), f"ros_log_{os.getuid()}")
    if reason_of_other := _why_not(other):
        raise ConfigError(
            f"{default or other}: {reason}; {other}: {reason_of_other}; "
            "set ROS_LOG_DIR to a directory that can be written"
        )
    os.environ["ROS_LOG_DIR"] = str(other)
    if default:
        print(f"{default}: {reason}; ROS logs go to {other}", file=sys.stderr)


def _default() -> Path | None:
    """The default of rcl; None without a home directory."""
    home = os.environ.get("HOME")
    ros_home = os.environ.get("ROS_HOME") or "~/.ros"
    if ros_home.startswith("~"):
        return Path(home + ros_home[1:], "log") if home else None
    return Path(ros_home, "log")


def _why_not(directory: Path) -> str | None:
    """Why no file can be made in a directory, which is made first; None if one can."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            return None
    except OSError as error:
        return (error.strerror or str(error)).lower()
