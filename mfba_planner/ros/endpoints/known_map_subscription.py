# SPDX-License-Identifier: Apache-2.0
"""The planner's map that is known before the drive, from the topic map; the first one counts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...core.errors import InputError
from ...perception.known_map import KnownMap
from ...planning.planner_params import PlannerParams
from ...recording.from_messages import known_map_from
from ..interface import topics
from ..runtime.base_node import GraphNode
from ..runtime.refused_inputs import RefusedInputs
from .planner_diagnostics import PlannerDiagnostics

_ANOTHER = (
    "map differs from the one in use, which is kept; to take the new one restart the planner, or "
    "clean it up and configure it again"
)
_NONE_YET = "no map yet; start a map server, or set known_map to false"


class KnownMapSubscription:
    """Subscribes to map for a planner whose parameters ask for it."""

    def __init__(
        self,
        node: GraphNode,
        frame: str,
        refused_inputs: RefusedInputs,
        diagnostics: PlannerDiagnostics,
        on_taken: Callable[[], None],
    ) -> None:
        """Subscribe to nothing yet; frame is that of the map; on_taken is called for the first."""
        self._node, self._frame = node, frame
        self._refused_inputs, self._diagnostics = refused_inputs, diagnostics
        self._params, self._on_taken = PlannerParams(), on_taken
        self.reset()

    def reset(self) -> None:
        """Forget the map; the node has destroyed all subscriptions."""
        self._is_subscribed = False
        self._received: KnownMap | None = None
        self._refusal = ""
        self._tell()

    def subscribe(self, params: PlannerParams) -> None:
        """Subscribe where it is needed; params are the planner's from now on."""
        self._params = params
        if params.reads_known_map and not self._is_subscribed:
            self._is_subscribed = True
            self._node.subscribe(topics.MAP, self._on_map)
        self._tell()

    @property
    def known_map(self) -> KnownMap | None:
        """The map, None if none was received or the planner does not ask for it."""
        return self._received if self._params.reads_known_map else None

    @property
    def missing(self) -> str:
        """Why the planner must wait, "" if it must not."""
        if not self._params.reads_known_map or self._received is not None:
            return ""
        return f"no map yet: {self._refusal}" if self._refusal else _NONE_YET

    def _tell(self) -> None:
        self._diagnostics.set_awaited("map", self.missing)

    def _on_map(self, message: Any) -> None:
        try:
            received = known_map_from(message, self._frame)
            if self._received is not None and received != self._received:
                raise InputError(_ANOTHER)
        except InputError as error:
            self._refused_inputs.add(error, "map")
            self._refusal = str(error)
            self._tell()
            return
        if self._received is None:
            self._received = received
            self._node.get_logger().info(f"map: {received.count} points are known")
            self._tell()
            self._on_taken()
