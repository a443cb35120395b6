# SPDX-License-Identifier: Apache-2.0
"""Scans as a decision uses them: of one lidar, or merged of several, and what says so in a bag."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..core.errors import InputError
from ..core.geometry import Pose2D
from ..core.lidar_extrinsics import CENTRED, LidarExtrinsics
from ..core.planner_types import NANO, Scan
from ..perception.lidar_sets import LidarScan, LidarSets
from ..perception.merged_scan import PlacedScan, merged_scan
from ..perception.near_returns import blind_ring
from ..perception.pose_history import PoseHistory
from ..perception.scan_to_sectors import aligned, require_usable
from .from_messages import decision_field, extrinsics_fields, require_frame, stamp_ns

FIELD, FRAME_FIELD = "merged_scans", "scan_frame"  # of planner/decision


class ScanPart(NamedTuple):
    """A scan that is part of a merged one; robot and velocity as in PlacedScan."""

    frame: str
    stamp_ns: int
    extrinsics: LidarExtrinsics
    robot: Pose2D
    velocity: tuple[float, float, float]

    def placed(self, scan: Scan) -> PlacedScan:
        """The scan of this part, in its lidar's frame, where it is on the robot."""
        return PlacedScan(aligned(scan, 0.0, self.extrinsics), self.robot, self.velocity)


class MountedScan(NamedTuple):
    """A scan and where its lidar is on the robot; a merged scan is centred, and has parts.

    frame is that of the message of a single lidar.
    """

    scan: Scan
    extrinsics: LidarExtrinsics
    parts: tuple[ScanPart, ...] = ()
    frame: str = ""

    @property
    def fields(self) -> dict[str, str]:
        """Keys of planner/decision that say what the scan was made of."""
        if not self.parts:
            return {**extrinsics_fields(self.extrinsics), FRAME_FIELD: self.frame}
        parts = [
            [part.frame, part.stamp_ns, *map(float, part.extrinsics), *part.robot, *part.velocity]
            for part in self.parts
        ]
        return {FIELD: json.dumps(parts)}


def parts_in(diagnostics: Any) -> tuple[ScanPart, ...]:
    """The parts of the merged scan of planner/decision, () for none. InputError if malformed."""
    text = decision_field(diagnostics, FIELD)
    if not text:
        return ()
    try:
        return tuple(_part(*values) for values in json.loads(text))
    except (TypeError, ValueError) as error:
        raise InputError(f"planner/decision: malformed {error}; was it edited?") from None


def _part(frame: str, stamp_ns: int, *values: float) -> ScanPart:
    x, y, yaw, flipped, rx, ry, ryaw, vx, vy, wz = map(float, values)
    extrinsics = LidarExtrinsics(x, y, yaw, bool(flipped))
    return ScanPart(str(frame), int(stamp_ns), extrinsics, Pose2D(rx, ry, ryaw), (vx, vy, wz))


class LidarMerging:
    """The scan messages of the lidars on one robot, which are merged where there are several.

    The same in virtual_sensor, in planner and on a recording.
    """

    def __init__(
        self,
        extrinsics_of: Callable[[str], LidarExtrinsics],
        name_of: Callable[[str], str],
        read: Callable[[Any], Scan],
        robot_radius_m: Callable[[], float],
        wanted: str = "",
    ) -> None:
        """`extrinsics_of` and `name_of` a frame, and `read` a message, raise InputError.

        The name is that of the lidar, "" for any single one. `wanted` is the only frame allowed.
        """
        self._extrinsics_of, self._name_of, self._read = extrinsics_of, name_of, read
        self._wanted = wanted
        self._robot_radius_m = robot_radius_m
        self.note = ""  # what to warn of in the last scan
        self.reset()

    def reset(self) -> None:
        """Forget all scans and poses."""
        self.sets: LidarSets[Any] = LidarSets()
        self.poses = PoseHistory()

    def add(self, message: Any, limit_s: float) -> bool:
        """Take a message; whether to perceive now by newest(). Raises InputError."""
        require_frame(message, self._wanted, "scan", "scan_frame")
        name = self._name_of(message.header.frame_id)
        return self.sets.add(name, stamp_ns(message.header.stamp), message, limit_s)

    def newest(self, limit_s: float) -> MountedScan:
        """The scan by the newest message of each lidar. Raises InputError."""
        return self._mounted(self.sets.newest(limit_s), limit_s)

    def at(self, stamp_ns: int, limit_s: float) -> MountedScan:
        """The scan by the newest messages up to a stamp. Raises InputError."""
        return self._mounted(self.sets.at(stamp_ns, limit_s), limit_s)

    def alone(self, message: Any) -> MountedScan:
        """The scan of a message of one lidar. Raises InputError."""
        scan, extrinsics = self._read(message), self._extrinsics_of(message.header.frame_id)
        self.note = blind_ring(aligned(scan, 0.0, extrinsics), self._robot_radius_m())
        return MountedScan(scan, extrinsics, frame=message.header.frame_id)

    def _mounted(self, scans: Sequence[LidarScan[Any]], limit_s: float) -> MountedScan:
        if not self.sets.are_several:
            return self.alone(scans[-1].value)
        now_ns = max(scan.stamp_ns for scan in scans)
        parts, placed = [], []
        for frame, at_ns, message in scans:
            scan, extrinsics = self._read(message), self._extrinsics_of(frame)
            lasts_ns = round(scan.time_increment_s * len(scan.ranges_m) / NANO)
            part = ScanPart(frame, at_ns, extrinsics, *self.poses.motion(at_ns, now_ns, lasts_ns))
            parts.append(part)
            placed.append(part.placed(scan))
            require_usable(placed[-1].scan, 0.0, placed[-1].scan.origin_m)
        radius_m = self._robot_radius_m()
        notes = (blind_ring(part.scan, radius_m) for part in placed)
        self.note = "; ".join(filter(None, (self.sets.silence(limit_s), *notes)))
        return MountedScan(merged_scan(placed, radius_m), CENTRED, tuple(parts))


def merge_again(
    parts: Sequence[ScanPart],
    messages: Sequence[Any],
    read: Callable[[Any], Scan],
    robot_radius_m: float,
) -> Scan:
    """The merged scan of recorded parts, in the robot's frame. Raises InputError."""
    placed = [part.placed(read(message)) for part, message in zip(parts, messages)]
    return merged_scan(placed, robot_radius_m)
