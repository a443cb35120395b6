# SPDX-License-Identifier: Apache-2.0
"""`mfba replay`: publish a bag's messages again; starts the node `replay`."""

from __future__ import annotations

from importlib import import_module


def main(args: list[str]) -> int:
    """Replay a bag."""
    code: int = import_module("mfba_planner.ros.nodes.replay").main(args)
    return code
