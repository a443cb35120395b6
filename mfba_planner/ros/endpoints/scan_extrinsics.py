# SPDX-License-Identifier: Apache-2.0
"""Where the lidar of a scan is mounted on the robot: by parameters, or by /tf and /tf_static."""

from __future__ import annotations

import math
import time

from ...core.errors import ConfigError, FrameError
from ...core.lidar_extrinsics import CENTRED, PARAMETERS, LidarExtrinsics
from ...recording.planar_poses import lidar_extrinsics
from ..interface import topics
from ..node_settings import ExtrinsicsSource, PlannerSettings, VirtualSensorSettings
from ..runtime.input_monitor import SEVERAL_REMEDY
from .transform_subscription import DISCOVERY_S, TransformSubscription

_REMEDY = f"publish it, or set {', '.join(PARAMETERS)}"


class ScanExtrinsics:
    """The extrinsics of the lidar by the frame of its scans; looked up once for each frame."""

    def __init__(
        self,
        settings: PlannerSettings | VirtualSensorSettings,
        transforms: TransformSubscription,
    ) -> None:
        """Raise ConfigError where transforms are asked for and cannot be read."""
        self._given = LidarExtrinsics(*(getattr(settings, name) for name in PARAMETERS))
        self._transforms = transforms
        self._base_frame = self.base = settings.base_frame
        self._found: dict[str, LidarExtrinsics] = {}
        self._frame, self._is_lockstep = "", settings.lockstep
        # In lockstep all publishers have been discovered before the first tick.
        self._discovered_s = -math.inf if settings.lockstep else time.monotonic() + DISCOVERY_S
        source = settings.scan_extrinsics
        self.is_required = source is ExtrinsicsSource.TF
        self.reads_tf = bool(topics.TRANSFORMS) and (
            self.is_required or (source is ExtrinsicsSource.AUTO and self._given == CENTRED)
        )
        if self.is_required and not self.reads_tf:
            raise ConfigError(
                "parameter scan_extrinsics='tf': tf2_msgs is not installed here; install it, or "
                f"set scan_extrinsics to parameters and {', '.join(PARAMETERS)}"
            )

    def robot_is(self, frame: str) -> None:
        """Take the robot's frame from the odometry, which may name none."""
        base = frame or self._base_frame
        if base != self.base:
            self.base = base
            self._found.clear()

    def is_known(self, frame: str) -> bool:
        """Whether tf gives where the lidar with this frame is."""
        if not (self.reads_tf and frame):
            return False
        try:
            self._find(frame)
        except FrameError:
            return False
        return True

    def name(self, frame: str) -> str:
        """The lidar's name: its frame where tf gives it, else "", that of any single lidar.

        Raises FrameError as of().
        """
        self.of(frame)
        return frame if self.is_known(frame) else ""

    def of(self, frame: str) -> LidarExtrinsics:
        """The extrinsics of the lidar with this frame; FrameError while they are not known."""
        if not self.reads_tf:
            self._require_one(frame)
            return self._given
        try:
            return self._find(frame)
        except FrameError as error:
            if not self._found and self._is_without_tf():
                self._require_one(frame)
                return self._given
            raise FrameError(f"scan: {error}; {_REMEDY}") from None

    def _find(self, frame: str) -> LidarExtrinsics:
        if frame not in self._found:
            self._found[frame] = lidar_extrinsics(self._transforms.tree, frame, self.base)
        return self._found[frame]

    def _require_one(self, frame: str) -> None:
        """In lockstep, where frames are not watched as in real time, refuse a second lidar."""
        self._frame = self._frame or frame
        if self._is_lockstep and frame != self._frame:
            raise FrameError(
                f"scan changes its frame from {self._frame!r} to {frame!r}; {SEVERAL_REMEDY}"
            )

    def _is_without_tf(self) -> bool:
        """Whether no tf is to be expected: nothing publishes any."""
        if self.is_required or time.monotonic() < self._discovered_s:
            return False
        return not self._transforms.is_published

    @property
    def text(self) -> str:
        """Where the extrinsics are from, for the node's first line."""
        if self.reads_tf:
            without = "" if self.is_required else ", without tf at the centre"
            return f"lidar mounted as tf says{without}"
        x, y, yaw, flipped = self._given
        return (
            f"lidar mounted at ({x:g}, {y:g}) m, yaw {yaw:g}{', upside down' if flipped else ''}"
        )
