# SPDX-License-Identifier: Apache-2.0
"""`mfba run`: run an episode in ROS 2; calls the launcher."""

from __future__ import annotations

from .. import launcher


def main(args: list[str]) -> int:
    """Run an episode."""
    return launcher.main(args, prog="mfba run")
