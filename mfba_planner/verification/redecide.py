# SPDX-License-Identifier: Apache-2.0
"""Run the planner on a foreign recording of /scan and /odom, for `mfba verify`."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..core.errors import BagError, FrameError, InputError
from ..core.geometry import Point, Pose2D
from ..core.planner_types import Decision, Ranges, RefusalReason, Scan, observe
from ..perception.known_map import KnownMap
from ..perception.no_return import NoReturn
from ..perception.scan_to_sectors import aligned, sense_scan
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import make_planner
from ..planning.planner_params import PlannerParams
from ..recording.bag_reader import BagReader, DecodedMessage
from ..recording.decisions_with_sectors import DECISION, SECTORS, robots_with_decisions
from ..recording.fleet_topics import NO_NAMESPACE
from ..recording.from_messages import (
    goal_point,
    known_map_from,
    laser_scan,
    robot_pose,
    stamp_ns,
    value_or_refusal,
)
from ..simulation.decision_digest import digest
from .lidar_extrinsics import StaticFrames

ODOMETRY, SCAN, GOAL, GRID = (
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/LaserScan",
    "geometry_msgs/msg/PoseStamped",
    "nav_msgs/msg/OccupancyGrid",
)
GOAL_TOPIC, MAP_TOPIC = "goal_pose", "map"


@dataclass(frozen=True, slots=True, kw_only=True)
class RedecideParams:
    """Parameters that a recording lacks; goal and scan_yaw_rad None: as recorded."""

    robot_radius_m: float
    scan_no_return: NoReturn = NoReturn.INF
    scan_yaw_rad: float | None = None
    goal: Point | None = None
    scan: str = ""
    odom: str = ""
    planner: PlannerParams = field(default_factory=PlannerParams)
    sensor: SensorParams = field(default_factory=SensorParams)
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class RedecideResult:
    """The decisions on every scan; faults are errors of the recording, notes are not."""

    decided: tuple[Decision, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Digest of the decisions."""
        return digest(self.decided)


def is_foreign(reader: BagReader) -> bool:
    """Whether a bag has scans and odometry, but no decisions and no sectors."""
    types = {topic.type_name for topic in reader.topics.values()}
    ours = (
        SECTORS in reader.topics
        or DECISION in reader.topics
        or robots_with_decisions(reader) != [NO_NAMESPACE]
    )
    return not ours and {ODOMETRY, SCAN} <= types


def redecide_recording(path: str | Path, params: RedecideParams) -> RedecideResult:
    """Decide on every scan with the odometry of its stamp, or the newest recorded before it.

    Same as virtual_sensor (source: scan) and planner on a replay of the bag, with the lidar
    extrinsics of /tf_static. Raises BagError for a bag that cannot be read or has no goal, if
    topics must be named, for unknown lidar extrinsics, and where known_map finds no map.
    """
    with BagReader(path) as reader:
        reader.check_data()
        scan = _topic_name(reader, SCAN, params.scan, "--scan")
        odom = _topic_name(reader, ODOMETRY, params.odom, "--odom")
        faults: list[str] = []
        poses = _PoseLookup(reader, odom, faults)
        goals = _goals(reader, params)
        scan_yaw = _ScanYaw(reader, params, odom)
        run = _PlannerRun(params, poses, goals, faults, scan_yaw)
        if params.planner.reads_known_map:
            run.take_known_map(_known_map(reader, odom))
        return run.decide_all(reader, scan)


def _topic_name(reader: BagReader, type_name: str, wanted: str, option: str) -> str:
    found = sorted(name for name, topic in reader.topics.items() if topic.type_name == type_name)
    if wanted in found:
        return wanted
    if wanted or len(found) > 1:
        problem = (
            f"{option} {wanted}: not one of" if wanted else f"{len(found)} topics of {type_name},"
        )
        raise BagError(f"{reader.path}: {problem} {', '.join(found)}; name one with {option}")
    return found[0]


def _topics_named(reader: BagReader, type_name: str, name: str) -> list[str]:
    """The topics of a type and name, in any namespace."""
    return [
        topic
        for topic, found in reader.topics.items()
        if found.type_name == type_name and topic.rpartition("/")[2] == name
    ]


def _known_map(reader: BagReader, odom: str) -> KnownMap:
    """The first map that the planner would take, in the frame of the odometry."""
    frame = next((m.message.header.frame_id for m in reader.decoded([odom])), "")
    names, refusal = _topics_named(reader, GRID, MAP_TOPIC), f"no {MAP_TOPIC} was recorded"
    for message in reader.decoded(names) if names else ():
        try:
            return known_map_from(message.message, frame)
        except InputError as error:  # the planner would refuse it as well
            refusal = str(error)
    raise BagError(f"{reader.path}: known_map=true: {refusal}")


def _goals(reader: BagReader, params: RedecideParams) -> list[tuple[int, Point]]:
    """(log time in ns, goal), sorted by time."""
    if params.goal is not None:
        return [(-1, params.goal)]
    names = _topics_named(reader, GOAL, GOAL_TOPIC)
    goals = []
    for message in reader.decoded(names) if names else ():
        try:
            goals.append((message.log_time_ns, goal_point(message.message)))
        except InputError:  # the planner would refuse it as well
            continue
    if not goals:
        raise BagError(f"{reader.path}: no {GOAL_TOPIC} was recorded; give one with --goal X Y")
    return goals


def _rising(
    reader: BagReader, topic: str, faults: list[str]
) -> Iterator[tuple[int, DecodedMessage]]:
    """Yield (stamp, message); a stamp that does not rise is a fault, its message is skipped."""
    last_ns = -1
    for message in reader.decoded([topic]):
        stamp = stamp_ns(message.message.header.stamp)
        if stamp <= last_ns:
            faults.append(f"{topic}: stamp {stamp} ns comes after {last_ns} ns")
            continue
        last_ns = stamp
        yield stamp, message


class _PoseLookup:
    """All poses of a recording, by stamp and by log time."""

    def __init__(self, reader: BagReader, topic: str, faults: list[str]) -> None:
        self.by_stamp: dict[int, Pose2D | RefusalReason] = {}
        self._times_ns: list[int] = []
        self._all: list[tuple[int, Pose2D | RefusalReason]] = []
        for stamp, message in _rising(reader, topic, faults):
            pose = value_or_refusal(robot_pose, message.message)
            self.by_stamp[stamp] = pose
            self._times_ns.append(message.log_time_ns)
            self._all.append((stamp, pose))

    def newest(self, log_time_ns: int) -> tuple[int, Pose2D | RefusalReason] | None:
        """(stamp, pose) of the newest pose recorded up to a log time, None without one."""
        index = bisect_right(self._times_ns, log_time_ns)
        return self._all[index - 1] if index else None


class _ScanYaw:
    """The yaw of each scan's lidar on the robot, as given or from /tf_static."""

    def __init__(self, reader: BagReader, params: RedecideParams, odom: str) -> None:
        self.notes: list[str] = []
        self._given_yaw_rad = params.scan_yaw_rad
        self._path, self._frames = reader.path, StaticFrames(reader)
        self._base = next((m.message.child_frame_id for m in reader.decoded([odom])), "")
        self._yaws: dict[str, float] = {}

    def yaw_rad(self, scan: Any) -> float:
        """Yaw of the frame of a scan. Raises BagError if it is unknown."""
        if self._given_yaw_rad is not None:
            return self._given_yaw_rad
        frame = scan.header.frame_id
        if frame not in self._yaws:
            try:
                yaw, offset_m = self._frames.extrinsics(frame, self._base)
            except FrameError as error:
                raise BagError(f"{self._path}: {error}") from None
            self._yaws[frame] = yaw
            if yaw or offset_m:
                self.notes.append(
                    f"/tf_static: {frame} is rotated by {yaw:.4g} rad in {self._base}, "
                    f"{offset_m:.4g} m from its origin: --robot-radius must include that"
                )
        return self._yaws[frame]


class _PlannerRun:
    """One planner, run on the scans one by one."""

    def __init__(
        self,
        params: RedecideParams,
        poses: _PoseLookup,
        goals: list[tuple[int, Point]],
        faults: list[str],
        scan_yaw: _ScanYaw,
    ) -> None:
        self._params = params
        self._scan_yaw = scan_yaw
        self._poses = poses
        self._goals = goals
        self._faults = faults
        planner = replace(params.planner, robot_radius_m=params.robot_radius_m)
        self._planner = make_planner(planner, params.sensor, params.seed)
        self._pose = Pose2D(0.0, 0.0)
        self._counts: Counter[str] = Counter()

    def take_known_map(self, known_map: KnownMap) -> None:
        """Give the planner the map before it decides."""
        self._planner.set_known_map(known_map)

    def decide_all(self, reader: BagReader, topic: str) -> RedecideResult:
        decided = []
        for stamp, message in _rising(reader, topic, self._faults):
            decision = self._decide(stamp, message.log_time_ns, message.message)
            if decision is not None:
                decided.append(decision)
        return RedecideResult(
            decided=tuple(decided),
            faults=tuple(self._faults),
            notes=(
                *self._scan_yaw.notes,
                *(f"{count} scans {what}" for what, count in self._counts.items()),
            ),
        )

    def _decide(self, stamp: int, log_time_ns: int, scan: Any) -> Decision | None:
        if stamp in self._poses.by_stamp:
            pose_stamp, pose = stamp, self._poses.by_stamp[stamp]
        elif newest := self._poses.newest(log_time_ns):
            pose_stamp, pose = newest
            self._counts["without odometry of their stamp: the newest before them was taken"] += 1
        else:
            self._counts["before the first odometry: not decided"] += 1
            return None
        ranges = self._measure(pose, scan)
        if isinstance(ranges, str):
            self._counts["that the sensor refuses"] += 1
        goal = next((g for t, g in reversed(self._goals) if t <= log_time_ns), None)
        observation = observe(stamp, pose, ranges, goal, self._pose, max(stamp - pose_stamp, 0))
        self._pose = observation.pose
        if self._params.planner.reads_scan and not observation.refused:
            yaw = observation.pose.yaw + self._scan_yaw.yaw_rad(scan)
            observation = replace(observation, scan=aligned(self._laser_scan(scan), yaw))
        return self._planner.plan(observation)

    def _laser_scan(self, scan: Any) -> Scan:
        return laser_scan(scan, no_return=self._params.scan_no_return)

    def _measure(self, pose: Pose2D | RefusalReason, scan: Any) -> Ranges | RefusalReason:
        if isinstance(pose, str):
            return pose
        params = self._params
        yaw = pose.yaw + self._scan_yaw.yaw_rad(scan)
        return value_or_refusal(
            lambda x: sense_scan(self._laser_scan(x), yaw, params.robot_radius_m, params.sensor),
            scan,
        )
