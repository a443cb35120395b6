# SPDX-License-Identifier: Apache-2.0
"""The planner's odom, sectors, scan and map: converted, paired into the inputs of a decision."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

from ...core.errors import InputError
from ...core.geometry import Pose2D
from ...core.planner_types import Observation, RefusalReason
from ...perception.scan_to_sectors import aligned
from ...planning.planner_params import PerceptionInput, PlannerParams
from ...recording.from_messages import (
    laser_scan,
    robot_pose,
    scan_fields,
    sector_ranges,
    stamp_ns,
)
from ...recording.scan_parts import LidarMerging, MountedScan
from ..interface import topics
from ..node_settings import PlannerSettings
from ..runtime.base_node import GraphNode
from ..runtime.input_monitor import PAIRED, InputMonitor
from ..runtime.lockstep_inputs import Inputs, LockstepInputs
from ..runtime.refused_inputs import RefusedInputs
from ..runtime.stale_inputs import NewestInputs
from ..runtime.stamp_pairing import StampPairs
from .known_map_subscription import KnownMapSubscription
from .odometry_source import OdometrySource
from .planner_diagnostics import PlannerDiagnostics
from .scan_extrinsics import ScanExtrinsics
from .transform_subscription import TransformSubscription

MOST_HELD = 1000


class InputSubscriptions:
    """Calls on_inputs for each pair of odom and sectors; a refused message is its error text.

    For a planner that reads scans, sectors wait for the scan of their stamp. With perception=auto
    they wait only while `scan` has a publisher: without a lidar the sectors are all there is.
    """

    def __init__(
        self,
        node: GraphNode,
        settings: PlannerSettings,
        params: PlannerParams,
        refused_inputs: RefusedInputs,
        monitor: InputMonitor,
        diagnostics: PlannerDiagnostics,
        transforms: TransformSubscription,
        on_inputs: Callable[[Inputs], None],
    ) -> None:
        """Subscribe to nothing yet."""
        self._node, self._settings, self._monitor = node, settings, monitor
        self._params = params
        self._is_subscribed = self._is_subscribed_to_scan = False
        self._refused_inputs, self._diagnostics = refused_inputs, diagnostics
        self._on_inputs = on_inputs
        self.map = KnownMapSubscription(
            node, settings.odom_frame, refused_inputs, diagnostics, self._deliver_held
        )
        self._transforms, self.extrinsics = transforms, ScanExtrinsics(settings, transforms)
        self.odometry = OdometrySource(node, settings, transforms, monitor, self._on_odom)
        self._lidars = LidarMerging(
            self.extrinsics.of,
            self.extrinsics.name,
            lambda message: laser_scan(message, settings.scan_frame, settings.scan_no_return),
            lambda: self._params.robot_radius_m,
            settings.scan_frame,
        )
        self.range_max_m = 0.0  # of the newest sectors
        self.fields: dict[str, str] = {}  # of planner/decision: see scan_fields
        self.reset()

    def reset(self) -> None:
        """Forget what was received, as when time was set back."""
        lockstep = self._settings.lockstep
        self._pairs: LockstepInputs | NewestInputs = (
            LockstepInputs() if lockstep else NewestInputs()
        )
        limit = None if lockstep else PAIRED
        self._held: deque[Inputs] = deque(maxlen=MOST_HELD)  # lockstep: until there is a map
        self._scan_pairs: StampPairs[Any, Any] = StampPairs(repeat=True, limit=limit)
        self._lidars.reset()
        self._monitor.reset()

    def subscribe(self) -> None:
        """Subscribe to odom and sectors, and to scan and map where they are needed.

        Scan comes first: a node that has discovered a later subscription has discovered it too,
        so that no first scan is lost.
        """
        self._is_subscribed, self._is_subscribed_to_scan = True, False
        self.set_params(self._params)
        frame = self._settings.odom_frame
        self.odometry.subscribe()
        self._monitor.subscribe(topics.SECTORS, self._on_sectors, frame=frame)

    def text(self, params: PlannerParams) -> str:
        """What decides and by what, for the node's first line."""
        by, lidar = "sectors", ""
        if params.reads_scan:
            by, lidar = f"perception {params.perception.value}", f"; {self.extrinsics.text}"
        return (
            f"decides: {params.label}, {by}, {params.drive.value}, robot radius "
            f"{params.robot_radius_m:g} m, {params.speed_mps:g} m/s{lidar}{self.odometry.text}"
        )

    def set_params(self, params: PlannerParams) -> None:
        """Use scans and a map, or not, from now on; params are the planner's."""
        self._params = params
        if self._is_subscribed:
            self.map.subscribe(params)
        if params.reads_scan and self._is_subscribed and not self._is_subscribed_to_scan:
            frame = self._settings.scan_frame
            if self.extrinsics.reads_tf:
                self._transforms.subscribe()
            self._monitor.subscribe(
                topics.SCAN,
                self._on_scan,
                depth=PAIRED,
                frame=frame,
                is_merged=self.extrinsics.is_known,
            )
            self._is_subscribed_to_scan = True

    def unsubscribed(self) -> None:
        """The node has destroyed all subscriptions."""
        self._is_subscribed = self._is_subscribed_to_scan = False
        self._transforms.unsubscribed()
        self.map.reset()

    def stale(self, timeout_s: float) -> Inputs | None:
        """In real time the newest inputs if one is older than timeout_s."""
        self._monitor.timeout_s = timeout_s
        return self._pairs.stale(time.monotonic(), timeout_s)

    def add_scan(self, observation: Observation, inputs: Inputs) -> Observation:
        """Return the observation with the scan that its sectors were computed from.

        It is refused while the map is missing.
        """
        self.fields = {}
        if self.map.missing and not observation.refused:
            return replace(observation, refused=self.map.missing)
        if inputs.scan is None or observation.refused:
            return observation
        pose = inputs.sensed[1] if inputs.sensed else observation.pose
        if inputs.sensed:
            self.fields = scan_fields(inputs.pose_stamp_ns, pose)
        if self.extrinsics.reads_tf:
            self.fields |= inputs.scan.fields
        return replace(
            observation,
            scan=aligned(inputs.scan.scan, pose.yaw, inputs.scan.extrinsics),
            sensed=inputs.sensed,
            pose_stamp_ns=inputs.pose_stamp_ns,
        )

    def _on_odom(self, message: Any) -> None:
        self.extrinsics.robot_is(message.child_frame_id)
        fault = self._check("odom", message)
        if fault is not None:
            self._receive("odom", message, robot_pose, self._add_odom, fault)

    def _add_odom(self, stamp: int, pose: Pose2D | RefusalReason, now_s: float) -> Inputs | None:
        inputs = self._pairs.add_odom(stamp, pose, now_s)
        if not isinstance(pose, str):
            self._lidars.poses.add(stamp, pose)
        return inputs

    def _on_sectors(self, message: Any) -> None:
        fault = self._check("sectors", message)
        if fault is None:
            return
        if self._waits_for_scan():
            self._pair_scan(message, fault, self._scan_pairs.add_a)
        else:
            self._receive_sectors(message, fault)

    def _waits_for_scan(self) -> bool:
        params = self._params
        if not params.reads_scan or params.perception is PerceptionInput.SCAN:
            return params.reads_scan
        name = self._node.resolve_topic_name(topics.SCAN.name)
        return self._node.count_publishers(name) > 0

    def _on_scan(self, message: Any) -> None:
        if not self._params.reads_scan:
            return
        fault = self._check("scan", message)
        if fault is not None:
            self._diagnostics.set_fault("scan", fault)
            if not fault:
                self._keep_scan(message)
            self._pair_scan(message, fault, self._scan_pairs.add_b)

    def _keep_scan(self, message: Any) -> None:
        """Keep a scan for sectors by another lidar's, unless it is refused when it is paired."""
        with suppress(InputError):
            self._lidars.add(message, self._monitor.timeout_s)

    def _check(self, name: str, message: Any) -> str | None:
        """Why a message is refused, "" if it is not; None: it must not even be paired."""
        verdict = self._monitor.check(name, message)
        if verdict.is_ordered:
            return verdict.fault
        self._refuse(name, verdict.fault)
        return None

    def _refuse(self, name: str, fault: str) -> None:
        self._pairs.refuse(name, fault)
        self._diagnostics.set_fault(name, fault)

    def _pair_scan(self, message: Any, fault: str, add: Any) -> None:
        try:
            pair = add(stamp_ns(message.header.stamp), (message, fault))
        except InputError as error:
            self._refused_inputs.add(error, "scan")
            return
        if pair is not None:
            (sectors, fault), (scan, scan_fault) = pair
            mounted, conversion_fault = self._convert("scan", scan, self._mounted_scan, "")
            if not conversion_fault:
                self._monitor.scan_note = self._lidars.note
            fault = fault or scan_fault or conversion_fault
            self._receive_sectors(sectors, fault, None if fault else mounted)

    def _mounted_scan(self, message: Any, _frame: str) -> MountedScan:
        """The scan, merged with those of other lidars that are not newer."""
        stamp, lidars = stamp_ns(message.header.stamp), self._lidars
        mounted = lidars.alone(message)  # it may be refused
        if not lidars.sets.are_several:
            return mounted
        return lidars.at(stamp, self._monitor.timeout_s)

    def _receive_sectors(self, message: Any, fault: str, scan: MountedScan | None = None) -> None:
        self.range_max_m = message.range_max
        add = partial(self._pairs.add_sectors, scan=scan)
        self._receive("sectors", message, sector_ranges, add, fault)

    def _receive(self, name: str, message: Any, convert: Any, add: Any, fault: str) -> None:
        """Convert one message and pair it; a complete pair goes to on_inputs."""
        stamp, now_s = stamp_ns(message.header.stamp), time.monotonic()
        value: Any = fault  # refused already
        if not fault:
            value, fault = self._convert(name, message, convert, self._settings.odom_frame)
        try:
            inputs = add(stamp, value, now_s)
        except InputError as error:
            self._refused_inputs.add(error, name)
            if fault:  # late, and older than one that was not
                self._refuse(name, fault)
            return
        self._diagnostics.input_received(name, stamp, now_s, fault)
        if inputs is None:
            return
        if self._settings.lockstep and self.map.missing:
            self._held.append(inputs)  # a bag that is replayed does not repeat them
        else:
            self._on_inputs(inputs)

    def _deliver_held(self) -> None:
        while self._held:
            self._on_inputs(self._held.popleft())

    def _convert(self, name: str, message: Any, convert: Any, frame: str) -> tuple[Any, str]:
        """The value and "", or the error text twice: as the value and as the fault."""
        try:
            return convert(message, frame), ""
        except InputError as error:
            self._refused_inputs.add(error, name)
            return str(error), str(error)
