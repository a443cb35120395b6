# SPDX-License-Identifier: Apache-2.0
"""All parameters of other nodes, asked for over their parameter services."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

from ..interface import parameters
from .node_runtime import GraphNode

PERIOD_S = 0.05
ASK_AGAIN_S = 1.0  # an answer can get lost while a server still looks for its client

Found = dict[str, dict[str, Any]]


class ParameterClient:
    """Asks every wanted node until it answers; done(found) when all have answered."""

    def __init__(self, node: GraphNode, wanted: set[str], done: Callable[[Found], None]) -> None:
        """Begin to ask, while the node spins."""
        self._node = node
        self._done = done
        self._askers: dict[str, AsyncParameterClient] = {}
        self._asked_at: dict[str, float] = {}
        self.wanted = wanted
        self.found: Found = {}
        if wanted:
            self._timer = node.every(PERIOD_S, self._ask)

    @property
    def absent(self) -> list[str]:
        """Nodes that have not answered yet."""
        return sorted(self.wanted - self.found.keys())

    def _ask(self) -> None:
        now = time.monotonic()
        for name in self.absent:
            asker = self._askers.get(name) or AsyncParameterClient(self._node, name)
            self._askers[name] = asker
            waited = now - self._asked_at.get(name, float("-inf"))
            if waited >= ASK_AGAIN_S and asker.services_are_ready():
                self._asked_at[name] = now
                asker.list_parameters(callback=partial(self._on_listed, name))
        if not self.absent:
            self._node.destroy_timer(self._timer)
            self._let_go()
            self._done(self.found)

    def _let_go(self) -> None:
        """Destroy the clients, six per node: each is one more thing to wait for at every turn."""
        for client in list(self._node.clients):
            self._node.destroy_client(client)
        self._askers.clear()

    def _on_listed(self, name: str, future: Any) -> None:
        listed = list(future.result().result.names)
        self._askers[name].get_parameters(listed, callback=partial(self._on_values, name, listed))

    def _on_values(self, name: str, listed: list[str], future: Any) -> None:
        values = map(parameter_value_to_python, future.result().values)
        self.found[name] = {key: parameters.plain(value) for key, value in zip(listed, values)}
