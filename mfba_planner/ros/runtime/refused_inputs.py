# SPDX-License-Identifier: Apache-2.0
"""The messages a node refused: counted by topic and kind of error, and logged."""

from __future__ import annotations

from collections import Counter

from rclpy.node import Node

from ...core.errors import FrameError, StampError

_KINDS = {FrameError: "frame", StampError: "stamp"}


class RefusedInputs:
    """Counts the inputs a node refused and logs them, once a second at most."""

    def __init__(self, node: Node) -> None:
        """Start at 0."""
        self.by_kind: Counter[str] = Counter()
        self.last = ""
        self._node = node

    @property
    def count(self) -> int:
        """How many were refused."""
        return self.by_kind.total()

    def add(self, error: Exception, source: str = "input") -> None:
        """Count one refused input of a source by the kind of its error."""
        kind = next((name for cls, name in _KINDS.items() if isinstance(error, cls)), "value")
        self.by_kind[f"{source}: {kind}"] += 1
        self.last = str(error)
        self._node.get_logger().warning(
            f"refused ({self.count} so far): {error}", throttle_duration_sec=1.0
        )
