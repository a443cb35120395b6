# SPDX-License-Identifier: Apache-2.0
"""Reads all parameters of other nodes through their parameter services."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.parameter import parameter_value_to_python

from ..interface import parameters
from .base_node import GraphNode

PERIOD_S = 0.05
RETRY_S = 1.0  # a response can get lost while a server has not discovered its client yet
RENEW_S = 4.0  # a client that gets none for so long is replaced: a server may never discover it

NodeParameters = dict[str, dict[str, Any]]  # by node, by parameter


class ParameterClient:
    """Requests every node's parameters until it responds; then calls on_done(values) once.

    With the two clients that this takes: rclpy's AsyncParameterClient has six per node, of which
    every node of the graph is told.
    """

    def __init__(
        self, node: GraphNode, nodes: set[str], on_done: Callable[[NodeParameters], None]
    ) -> None:
        """Start to send requests while the node spins."""
        self._node = node
        self._on_done = on_done
        self._clients: dict[str, tuple[Client, Client]] = {}  # of names, of values
        self._requested_s: dict[str, float] = {}
        self._created_s: dict[str, float] = {}
        self._nodes = nodes
        self.values: NodeParameters = {}
        if nodes:
            self._timer = node.create_wall_timer(PERIOD_S, self._request)

    @property
    def pending(self) -> list[str]:
        """Nodes whose parameters are not read yet."""
        return sorted(self._nodes - self.values.keys())

    def _request(self) -> None:
        now = time.monotonic()
        for name in self.pending:
            if now - self._created_s.get(name, float("-inf")) >= RENEW_S:
                self._create(name, now)
            clients = self._clients[name]
            waited = now - self._requested_s.get(name, float("-inf"))
            if waited >= RETRY_S and all(client.service_is_ready() for client in clients):
                self._requested_s[name] = now
                request = clients[0].call_async(ListParameters.Request())
                request.add_done_callback(partial(self._on_names, name))
        if not self.pending:
            self._node.destroy_timer(self._timer)
            for name in list(self._clients):
                self._destroy(name)
            self._on_done(self.values)

    def _create(self, name: str, now: float) -> None:
        """Create the client of a node, or replace it."""
        self._destroy(name)
        self._clients[name] = (
            self._node.create_client(ListParameters, f"{name}/list_parameters"),
            self._node.create_client(GetParameters, f"{name}/get_parameters"),
        )
        self._created_s[name] = now
        self._requested_s.pop(name, None)

    def _destroy(self, name: str) -> None:
        """Destroy the clients of a node: an executor waits for each of them at every spin."""
        for client in self._clients.pop(name, ()):
            self._node.destroy_client(client)

    def _on_names(self, node: str, future: Any) -> None:
        names = list(future.result().result.names)
        if node not in self._clients:
            return  # a late response: the values are read
        values = self._clients[node][1].call_async(GetParameters.Request(names=names))
        values.add_done_callback(partial(self._on_values, node, names))

    def _on_values(self, node: str, names: list[str], future: Any) -> None:
        values = map(parameter_value_to_python, future.result().values)
        self.values[node] = {name: parameters.plain(value) for name, value in zip(names, values)}


def with_full_names(values: NodeParameters, namespace: str) -> NodeParameters:
    """The same with the nodes' names below the root, of a client in this namespace."""
    return {f"{namespace}/{name}".strip("/"): found for name, found in values.items()}
