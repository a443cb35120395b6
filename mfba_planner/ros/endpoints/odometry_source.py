# SPDX-License-Identifier: Apache-2.0
"""The robot's odometry: from odom, or from tf where nothing publishes odom."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from rclpy.timer import Timer

from ...core.errors import ConfigError
from ...recording.odometry_from_tf import ODOM_FRAME, OdometryFromTf
from ..interface import topics
from ..node_settings import OdomSource, PlannerSettings, VirtualSensorSettings
from ..runtime.base_node import GraphNode
from ..runtime.input_monitor import NEWEST, InputMonitor
from .transform_subscription import DISCOVERY_S, TransformSubscription

_WATCH_PERIOD_S = 0.5


class OdometrySource:
    """Calls on_odom with each Odometry, or with what takes its place."""

    def __init__(
        self,
        node: GraphNode,
        settings: PlannerSettings | VirtualSensorSettings,
        transforms: TransformSubscription,
        monitor: InputMonitor,
        on_odom: Callable[[Any], None],
    ) -> None:
        """Subscribe to nothing yet. Raises ConfigError if tf is asked for and cannot be read."""
        self._node, self._settings, self._monitor = node, settings, monitor
        self._transforms, self._on_odom = transforms, on_odom
        self._source = settings.odom_source
        if self._source is OdomSource.TF and not topics.TRANSFORMS:
            raise ConfigError(
                "parameter odom_source='tf': tf2_msgs is not installed here; install it, or "
                "publish odom"
            )
        self._reads_tf = bool(topics.TRANSFORMS) and self._source is not OdomSource.TOPIC
        self._by_tf = OdometryFromTf(
            transforms.tree, settings.odom_frame or ODOM_FRAME, settings.base_frame
        )
        self._any_received = self._is_by_tf = False
        self._discovered_s = -math.inf
        self._timer: Timer | None = None

    @property
    def text(self) -> str:
        """Where the odometry is from, for the node's first line; "" for odom alone."""
        if not self._reads_tf:
            return ""
        frames = f"{self._by_tf.base_frame} in {self._by_tf.odom_frame}"
        if self._source is OdomSource.TF:
            return f"; odometry by tf, {frames}"
        return f"; odometry by tf, {frames}, where nothing publishes odom"

    def subscribe(self, depth: int = NEWEST) -> None:
        """Subscribe to odom, and to tf as soon as it is needed."""
        s = self._settings
        if self._source is not OdomSource.TF:
            self._monitor.subscribe(topics.ODOM, self._on_message, depth=depth, frame=s.odom_frame)
        if not self._reads_tf:
            return
        self._transforms.on_moving = self._on_moving
        if s.lockstep or self._source is OdomSource.TF:
            self._transforms.subscribe()
        else:
            # Until then publishers may not have been discovered; most robots need no tf.
            self._discovered_s = time.monotonic() + DISCOVERY_S
            if self._timer is not None:  # of an earlier configuration
                self._node.destroy_timer(self._timer)
            self._timer = self._node.create_wall_timer(_WATCH_PERIOD_S, self._on_timer)

    def _on_timer(self) -> None:
        assert self._timer is not None
        if time.monotonic() < self._discovered_s:
            return
        if not self._any_received and not self._is_published():
            self._transforms.subscribe()
        if self._any_received or self._is_by_tf:
            self._timer.cancel()

    def _on_message(self, message: Any) -> None:
        self._any_received = True
        self._on_odom(message)

    def _on_moving(self, message: Any) -> None:
        if self._source is OdomSource.AUTO and (
            self._any_received or time.monotonic() < self._discovered_s or self._is_published()
        ):
            return
        odometry = self._by_tf.of(message)
        if odometry is None:
            return
        if not self._is_by_tf:
            self._is_by_tf = True
            self._monitor.odom_source = "tf"
            frames = f"{odometry.child_frame_id} in {odometry.header.frame_id}"
            self._node.get_logger().info(f"odometry by tf: {frames}")
        self._on_odom(odometry)

    def _is_published(self) -> bool:
        name = self._node.resolve_topic_name(topics.ODOM.name)
        return self._node.count_publishers(name) > 0
