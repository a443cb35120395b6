# SPDX-License-Identifier: Apache-2.0
"""`mfba replay`: the node of that name."""

from __future__ import annotations

from importlib import import_module


def main(args: list[str]) -> int:
    """Play a bag."""
    code: int = import_module("mfba_planner.ros.nodes.replay").main(args)
    return code
