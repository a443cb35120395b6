# SPDX-License-Identifier: Apache-2.0
"""The planner's local map as nav_msgs/OccupancyGrid: at a low rate, and only when it changed."""

from __future__ import annotations

from ...perception.static_map import StaticMap
from ..interface import topics
from ..interface.markers import RateLimit
from ..interface.to_messages import occupancy_grid_msg
from ..node_settings import PlannerSettings
from ..runtime.base_node import GraphNode


class LocalMapPublisher:
    """Publishes the map of a planner that keeps one."""

    def __init__(self, node: GraphNode, settings: PlannerSettings) -> None:
        """Advertise the topic, unless map_period_s is 0."""
        self._frame = settings.odom_frame
        self._rate = RateLimit(settings.map_period_s)
        self._publisher = node.advertise(topics.LOCAL_MAP) if settings.map_period_s else None
        self._published: tuple[StaticMap, int] | None = None  # and its version

    def publish_if_due(self, local_map: StaticMap | None, stamp_ns: int) -> None:
        """Publish a map that has changed, once a period of the decisions' stamps.

        A map without a point is published only after one with points.
        """
        if self._publisher is None or local_map is None:
            return
        present = (local_map, local_map.version)
        if present == self._published or not (local_map.count or self._published):
            return
        if not self._rate.due(stamp_ns):
            return
        grid = local_map.known_grid()
        if grid is not None:
            self._publisher.publish(occupancy_grid_msg(grid, self._frame))
            self._published = present
