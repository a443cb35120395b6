# SPDX-License-Identifier: Apache-2.0
"""Reads all parameters of other nodes: as they publish them, or through their services."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.parameter import parameter_value_to_python

from ...recording.configuration_attachment import published_parameters
from ..interface import parameters
from .base_node import GraphNode

PERIOD_S = 0.05
PUBLISHED_S = 1.0  # from a node's discovery; until then only what it publishes counts
RETRY_S = 1.0  # a response can get lost while a server has not discovered its client yet
RENEW_S = 4.0  # a client that gets none for so long is replaced: a server may never discover it

NodeParameters = dict[str, dict[str, Any]]  # by node, by parameter


class ParameterClient:
    """Waits for all parameters of the nodes; then calls on_done(values) once.

    Our nodes publish theirs, latched. Those of which published() is not called are requested until
    they respond, with the two clients that this takes: rclpy's AsyncParameterClient has six per
    node, of which every node of the graph is told.
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
        self._discovered_s: dict[str, float] = {}
        if nodes:
            self._timer = node.create_wall_timer(PERIOD_S, self._on_timer)

    @property
    def pending(self) -> list[str]:
        """Nodes whose parameters are not read yet."""
        return sorted(self._nodes - self.values.keys())

    def published(self, name: str, text: str) -> None:
        """Take what a node publishes on its topic of parameters; what is no JSON is ignored."""
        values = published_parameters(text)
        if name in self.pending and values is not None:
            self.values[name] = values

    def _on_timer(self) -> None:
        if self.pending:
            self._request(time.monotonic())
            return
        self._node.destroy_timer(self._timer)
        for name in list(self._clients):
            self._destroy(name)
        self._on_done(self.values)

    def _request(self, now: float) -> None:
        found = self._node.get_node_names_and_namespaces()
        known = {f"{namespace.rstrip('/')}/{node}" for node, namespace in found}
        for name in self.pending:
            service = self._node.resolve_service_name(f"{name}/list_parameters")
            if service.rpartition("/")[0] in known:
                self._discovered_s.setdefault(name, now)
            discovered_s = self._discovered_s.get(name)
            if discovered_s is None or now - discovered_s < PUBLISHED_S:
                continue
            if now - self._created_s.get(name, float("-inf")) >= RENEW_S:
                self._create(name, now)
            clients = self._clients[name]
            waited = now - self._requested_s.get(name, float("-inf"))
            if waited >= RETRY_S and all(client.service_is_ready() for client in clients):
                self._requested_s[name] = now
                request = clients[0].call_async(ListParameters.Request())
                request.add_done_callback(partial(self._on_names, name))

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
    return {
        (name if name.startswith("/") else f"{namespace}/{name}").strip("/"): found
        for name, found in values.items()
    }
